// The Sun's disc: mean radiance of each pixel [W m-2 sr-1], and the share of it that the disc covers.
//
// Along a row of the disc the limb-darkened profile is integrated in closed form, across rows by
// Gauss's rule in the angle t of sin(t) = height. All pixels of a row take the same heights, so
// their sum is the whole disc's light, however few pixels or parts of one it spans.
#include "block/sundisc"
#include "common/ellipse.glsl"

layout(location = 0, index = 0) out vec4 radiance;
layout(location = 0, index = 1) out vec4 share;

// Integral from 0 to x of 1, mu and mu^2, where mu = sqrt(c^2 - x^2).
vec3 moments(float x, float c) {
    float mu = sqrt(max(c * c - x * x, 0.0));
    return vec3(x, 0.5 * (x * mu + c * c * atan(x, mu)), x * (c * c - x * x / 3.0));
}

void main() {
    Ellipse disc = Ellipse(ellipse_centre, ellipse_scale, ellipse_shear);
    vec2 corner = floor(gl_FragCoord.xy) - disc.centre;
    vec2 rows = rows_of_pixel(disc, corner);
    vec3 sum = vec3(0.0);
    for (int i = 0; i < node_count; ++i) {
        float t = mix(rows.x, rows.y, nodes[i].x);
        vec2 x = stretch_of_pixel(disc, corner, t);
        sum += nodes[i].y * cos(t) * (moments(x.y, cos(t)) - moments(x.x, cos(t)));
    }
    // From the area of the unit circle to that of a pixel.
    sum *= (rows.y - rows.x) / (disc.scale.x * disc.scale.y);
    float covered = full_if_nearly(sum.x);
    sum *= covered / max(sum.x, 1e-30);
    vec4 u = sun_limb_u, v = sun_limb_v;
    vec4 light = (1.0 - u - v) * sum.x + (u + 2.0 * v) * sum.y - v * sum.z;
    radiance = sun_radiance * light / (1.0 - u / 3.0 - v / 6.0);
    share = vec4(covered);
}
