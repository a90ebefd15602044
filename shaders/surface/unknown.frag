// Which points of each page are to be searched, a bit for each, and from bit 4 on which lie near casters.
#include "common/texels.glsl"
#include "gbuffer/page_places.glsl"
#include "surface/unknown_sunlight.glsl"

uniform sampler2D sunlight;

out uint mask;

void main() {
    ivec2 entry = ivec2(gl_FragCoord.xy);
    ivec2 first = texel_of_page(entry.y * 4 * SQUARES + entry.x);
    mask = 0u;
    for (int k = 0; k < 4; ++k) {
        float share = read_texel(sunlight, first + ivec2(k & 1, k >> 1)).x;
        mask |= share == SEARCH_TELLS ? 1u << uint(k) : 0u;
        mask |= share == NEIGHBOURS_TELL ? 16u << uint(k) : 0u;
    }
}
