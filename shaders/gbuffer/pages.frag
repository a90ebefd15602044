// How many pages each block of 2 x 2 cells takes: as many as its fullest cell has groups. The upper bit
// tells whether a sample of the block sees nothing, the next one whether its cells see one triangle.
#define GROUPED
#include "gbuffer/cells.glsl"

out uint pages;

void main() {
    ivec2 first = BLOCK * ivec2(gl_FragCoord.xy), last = min(first + BLOCK, cells);
    pages = 0u;
    uint in_all = ONE_TRIANGLE, in_any = 0u;
    for (int y = first.y; y < last.y; ++y)
        for (int x = first.x; x < last.x; ++x) {
            uvec4 groups = read_texel(cell_groups, ivec2(x, y));
            pages = max(pages, uint(count_of(groups)));
            in_any |= groups.y;
            in_all &= groups.y;
        }
    pages |= ((in_any & BARE) != 0u ? 128u : 0u) | (in_all != 0u ? 64u : 0u);
}
