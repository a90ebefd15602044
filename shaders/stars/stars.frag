// A star's light in a pixel, radiance [W m-2 sr-1].
//
// The shares of the 3 x 3 pixels are the quadratic B-spline's: the pixel means of a star blurred by
// a triangle of one pixel's full width at half height. Their sum is 1, their centroid the star's
// place and their second moment 1/4 pixel^2 along each axis, wherever in its pixel the star stands.
#include "block/stars"

flat in vec2 star;
flat in vec4 irradiance;

out vec4 radiance;

void main() {
    vec2 off = abs(gl_FragCoord.xy - star);
    vec2 wing = 1.5 - off;
    vec2 part = mix(0.75 - off * off, 0.5 * wing * wing, step(0.5, off));
    // A pixel spans cos^3 / f^2 [sr].
    vec2 tangent = (gl_FragCoord.xy - principal_point) / focal_length;
    float secant2 = 1.0 + dot(tangent, tangent);
    float per_steradian = focal_length * focal_length * secant2 * sqrt(secant2);
    radiance = irradiance * (part.x * part.y * per_steradian);
}
