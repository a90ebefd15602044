// The table of transmittances to space: optical depth by Gauss' two points in each of many cells.
#include "air/profile.glsl"
#include "air/transmittance.glsl"
#include "block/airtable"

out vec4 transmittance;

const int CELLS = 64;

// Along the ray from `near` to `far` [km] past its lowest point, cells crowded about it.
vec4 depth_between(float lowest, float mu, float near, float far) {
    float r0 = ground_radius + lowest;
    vec4 depth = vec4(0.0);
    for (int i = 0; i < 2 * CELLS; ++i) {
        float x = (float(i / 2) + 0.5 + (i % 2 == 0 ? -0.5 : 0.5) / sqrt(3.0)) / float(CELLS);
        float s = near + (far - near) * x * x;
        float rise = s * (2.0 * r0 * mu + s);
        float height = lowest + rise / (sqrt(r0 * r0 + rise) + r0);
        depth += medium_at(height).extinction * x;
    }
    return depth * (far - near) / float(CELLS);
}

void main() {
    vec2 place = transmittance_texel(gl_FragCoord.xy, table_size);
    float height = place.x, mu = place.y;
    float r = ground_radius + height, top = above_ground(air_top), here = above_ground(height);
    float b = r * mu;
    if (b >= 0.0) {
        float way = (top - here) / (b + sqrt(b * b + top - here) + 1e-9);
        transmittance = exp(-depth_between(height, mu, 0.0, way));
        return;
    }
    float d = min(b * b - here, 0.0);
    float lowest = -d / (ground_radius + sqrt(ground_radius * ground_radius - d));
    vec4 depth = depth_between(lowest, 0.0, 0.0, -b)
               + depth_between(lowest, 0.0, 0.0, sqrt(max(top + d, 0.0)));
    transmittance = exp(-depth);
}
