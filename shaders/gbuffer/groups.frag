// The groups of each cell, and whether all texels of its window see one surface.
#include "gbuffer/cells.glsl"

uniform usampler2D seen_surfaces;

// One for each layer, as many as a cell may have samples. The upper bits of the first hold the number of samples
// in the cell, those of the second the number of groups, and above that BARE and so on.
layout(location = 0) out uvec4 groups[FOURS];

void main() {
    ivec2 cell = ivec2(gl_FragCoord.xy), first = first_texel(cell);
    ivec2 last = textureSize(seen_surfaces, 0) - 1;
    uint surface[CELL_TEXELS * CELL_TEXELS];
    uint left = 0u, total = 0u;
    uint lowest = ~0u, highest = 0u;
    for (int j = 0; j < CELL_TEXELS; ++j)
        for (int i = 0; i < CELL_TEXELS; ++i) {
            ivec2 texel = first + ivec2(i, j);
            bool inside = cell_of(texel) == cell;
            uint seen = read_texel(seen_surfaces, clamp(texel, ivec2(0), last)).r;
            surface[CELL_TEXELS * j + i] = seen;
            total += uint(inside);
            left |= uint(inside && seen != 0u) << (STRIDE * j + i);
            lowest = min(lowest, seen);
            highest = max(highest, seen);
        }
    bool bare = samples_of(left) < total, one_surface = lowest == highest;
    uint chosen_groups[4 * FOURS], count = uint(left != 0u);
    for (int layer = 0; layer < 4 * FOURS; ++layer) chosen_groups[layer] = 0u;
    chosen_groups[0] = left;
    int layer = 0;
    // Few windows show several surfaces. A loop with a limit would be worked out to its end.
    while (!one_surface && left != 0u) {
        uint chosen = 0u, group = 0u;
        for (int k = 0; k < CELL_TEXELS * CELL_TEXELS; ++k) {
            uint bit = 1u << (STRIDE * (k / CELL_TEXELS) + k % CELL_TEXELS);
            bool here = (left & bit) != 0u;
            if (here && chosen == 0u) chosen = surface[k];
            if (here && surface[k] == chosen) group |= bit;
        }
        left ^= group;
        chosen_groups[min(layer, 4 * FOURS - 1)] = group;
        count = uint(min(++layer, 4 * FOURS));
    }
    chosen_groups[0] |= total << TEXELS;
    chosen_groups[1] |= count << TEXELS | (bare ? BARE : 0u) | (one_surface ? ONE_SURFACE : 0u);
    for (int k = 0; k < FOURS; ++k)
        groups[k] = uvec4(chosen_groups[4 * k], chosen_groups[4 * k + 1], chosen_groups[4 * k + 2],
                          chosen_groups[4 * k + 3]);
}
