// A star's light in a pixel, radiance [W m-2 sr-1].
//
// The share of a pixel is its mean of a star blurred by a triangle of the given full widths at half
// height. The sum of the shares is 1, their centroid the star's place, wherever in its pixel the star
// stands. Of a triangle one pixel wide, 3 x 3 pixels have the quadratic B-spline's shares, whose
// second moment is 1/4 pixel^2 along each axis.
#include "block/stars"

flat in vec2 star;
flat in vec2 width;
flat in vec4 irradiance;

out vec4 radiance;

// Share of the triangle below an offset from its middle, along each axis.
vec2 below(vec2 off) {
    vec2 t = clamp(off / width, -1.0, 1.0);
    return 0.5 + t * (1.0 - 0.5 * abs(t));
}

void main() {
    vec2 off = gl_FragCoord.xy - star;
    vec2 part = below(off + 0.5) - below(off - 0.5);
    // A pixel spans cos^3 / f^2 [sr].
    vec2 tangent = (gl_FragCoord.xy - principal_point) / focal_length;
    float secant2 = 1.0 + dot(tangent, tangent);
    float per_steradian = focal_length * focal_length * secant2 * sqrt(secant2);
    radiance = irradiance * (part.x * part.y * per_steradian);
}
