// Which points of each page are to be searched: a bit for each.
#include "gbuffer/page_places.glsl"

// Negative where the share of the sunlight is unknown.
uniform sampler2D sunlight;

out uint mask;

void main() {
    ivec2 entry = ivec2(gl_FragCoord.xy);
    ivec2 first = texel_of_page(entry.y * 4 * SQUARES + entry.x);
    mask = 0u;
    for (int k = 0; k < 4; ++k) {
        bool unknown = texelFetch(sunlight, first + ivec2(k & 1, k >> 1), 0).x < 0.0;
        mask |= unknown ? 1u << uint(k) : 0u;
    }
}
