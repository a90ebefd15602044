// The groups of each cell. TELL_TRIANGLES: and whether all texels of its window see one triangle.
#include "gbuffer/cells.glsl"

uniform usampler2D visibility;

// One for each layer. The upper bits of the first hold the number of samples in the cell, those of the
// second the number of groups, and above that BARE and ONE_TRIANGLE.
layout(location = 0) out uvec4 groups[LAYERS / 4];

void main() {
    ivec2 cell = ivec2(gl_FragCoord.xy), first = first_texel(cell);
    ivec2 last = textureSize(visibility, 0) - 1;
    uint surface[CELL_TEXELS * CELL_TEXELS];
    uint left = 0u, total = 0u, lowest = ~0u, highest = 0u;
    for (int j = 0; j < CELL_TEXELS; ++j)
        for (int i = 0; i < CELL_TEXELS; ++i) {
            ivec2 texel = first + ivec2(i, j);
            bool inside = cell_of(texel) == cell;
            uvec2 seen = read_texel(visibility, clamp(texel, ivec2(0), last)).rg;
            surface[CELL_TEXELS * j + i] = seen.g;
            total += uint(inside);
            left |= uint(inside && seen.g != 0u) << (STRIDE * j + i);
#ifdef TELL_TRIANGLES
            lowest = min(lowest, seen.r);
            highest = max(highest, seen.r);
#endif
        }
    bool bare = samples_of(left) < total;
    uint chosen_groups[LAYERS], count = 0u;
    for (int layer = 0; layer < LAYERS; ++layer) chosen_groups[layer] = 0u;
    int layer = 0;
    do {
        uint chosen = 0u, group = 0u;
        for (int k = 0; k < CELL_TEXELS * CELL_TEXELS; ++k) {
            uint bit = 1u << (STRIDE * (k / CELL_TEXELS) + k % CELL_TEXELS);
            bool here = (left & bit) != 0u;
            if (here && chosen == 0u) chosen = surface[k];
            if (here && surface[k] == chosen) group |= bit;
        }
        left ^= group;
        chosen_groups[layer] = group;
        count += uint(group != 0u);
    } while (++layer < LAYERS && left != 0u);
    chosen_groups[0] |= total << TEXELS;
    chosen_groups[1] |= count << TEXELS | (bare ? BARE : 0u)
                      | (lowest == highest && count == 1u ? ONE_TRIANGLE : 0u);
    for (int k = 0; k < LAYERS / 4; ++k)
        groups[k] = uvec4(chosen_groups[4 * k], chosen_groups[4 * k + 1], chosen_groups[4 * k + 2],
                          chosen_groups[4 * k + 3]);
}
