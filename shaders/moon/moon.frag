// The Moon: mean radiance of each pixel [W m-2 sr-1], and the share of it that the disc covers.
//
// Light by the law of simgl/physics/lunar_model.py, L = moon_radiance times the disc function times the
// map, a mean over points of the pixel; the covered share exact along rows, by Gauss's rule across them.
#include "block/moondisc"
#include "common/constants.glsl"
#include "common/ellipse.glsl"

// Reflectance over the disc's mean, as the map's codes of 0..255 over 128.
uniform sampler2D seas;

layout(location = 0, index = 0) out vec4 radiance;
layout(location = 0, index = 1) out vec4 share;

// Disc function at a place in units of the disc's radius, seen from afar. Just within the limb, where
// it is 0 / 0, stands for the limb and what lies past it.
float disc_function(vec2 place) {
    place *= min(0.9999 / max(length(place), 1e-6), 1.0);
    float mu = sqrt(max(1.0 - dot(place, place), 0.0));
    float mu0 = max(dot(vec3(place, mu), moon_sun.xyz), 0.0);
    return mix(0.5 * mu0, mu0 / max(mu0 + mu, 1e-6), moon_sun.w);
}

// Reflectance at a place of the disc over the mean of the whole; `level` of the map's pyramid.
float shade(vec2 place, float level) {
    place *= min(0.9999 / max(length(place), 1e-6), 1.0);
    vec3 axes = vec3(place, sqrt(1.0 - dot(place, place)));
    vec3 p = mat3(moon_from_disc) * axes;
    vec2 on_map = vec2(atan(p.y, p.x) / (2.0 * PI) + 0.5, 0.5 - atan(p.z, length(p.xy)) / PI);
    return mix(1.0, textureLod(seas, on_map, level).r * (255.0 / 128.0), has_seas);
}

void main() {
    Ellipse disc = Ellipse(ellipse_centre, ellipse_scale, ellipse_shear);
    vec2 corner = floor(gl_FragCoord.xy) - disc.centre;
    vec2 rows = rows_of_pixel(disc, corner);
    float covered = 0.0;
    for (int i = 0; i < node_count; ++i) {
        float t = mix(rows.x, rows.y, nodes[i].x);
        vec2 x = stretch_of_pixel(disc, corner, t);
        covered += nodes[i].y * cos(t) * (x.y - x.x);
    }
    covered = full_if_nearly(covered * (rows.y - rows.x) / (disc.scale.x * disc.scale.y));

    // The part of the pixel within the rectangle around the disc, which may be much smaller.
    vec2 low = max(corner, -half_size), high = min(corner + 1.0, half_size);
    mat2 to_disc = mat2(disc_from_pixel.xy, disc_from_pixel.zw);
    // Texels along a point's share of the disc, where the map is seen face on.
    float across = length(to_disc[0]) * (high.x - low.x) / float(points);
    float level = log2(max(across * float(textureSize(seas, 0).y) / PI, 1.0));
    float sum = 0.0, ground = 0.0, count = 0.0;
    for (int j = 0; j < points; ++j) {
        for (int i = 0; i < points; ++i) {
            vec2 place = to_disc * mix(low, high, (vec2(i, j) + 0.5) / float(points));
            float on_disc = step(dot(place, place), 1.0);
            float here = on_disc * shade(place, level);
            sum += disc_function(place) * here;
            ground += here;
            count += on_disc;
        }
    }
    vec2 middle = to_disc * (0.5 * (low + high));
    vec2 mean = vec2(sum, ground) / max(count, 1.0);
    if (count == 0.0) mean = vec2(disc_function(middle), 1.0) * shade(middle, level);
    radiance = (moon_radiance * mean.x + earthshine * mean.y) * covered;
    share = vec4(covered);
}
