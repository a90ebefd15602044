// How many pages each block of 2 x 2 cells takes: as many as its fullest cell has groups. The upper bits
// tell whether a sample of the block sees nothing, and whether each of its cells sees one surface.
#define GROUPED
#include "gbuffer/cells.glsl"

out uint pages;

void main() {
    ivec2 first = BLOCK * ivec2(gl_FragCoord.xy), last = min(first + BLOCK, cells);
    pages = 0u;
    uint in_all = ~0u, in_any = 0u;
    for (int y = first.y; y < last.y; ++y)
        for (int x = first.x; x < last.x; ++x) {
            uvec4 groups = read_texel(cell_groups, ivec2(x, y));
            pages = max(pages, uint(count_of(groups)));
            in_any |= groups.y;
            in_all &= groups.y;
        }
    pages |= ((in_any & BARE) != 0u ? BLOCK_BARE : 0u) | ((in_all & ONE_SURFACE) != 0u ? BLOCK_ONE_SURFACE : 0u);
}
