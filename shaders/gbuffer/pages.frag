// How many pages each block of 2 x 2 cells takes: as many as its fullest cell has groups. The upper bit
// tells whether a sample of the block sees nothing.
#define GROUPED
#include "gbuffer/cells.glsl"

out uint pages;

void main() {
    ivec2 first = BLOCK * ivec2(gl_FragCoord.xy), last = min(first + BLOCK, cells);
    pages = 0u;
    uint bare = 0u;
    for (int y = first.y; y < last.y; ++y)
        for (int x = first.x; x < last.x; ++x) {
            uvec4 groups = read_texel(cell_groups, ivec2(x, y));
            pages = max(pages, uint(count_of(groups)));
            bare |= groups.y & BARE;
        }
    if (bare != 0u) pages |= 128u;
}
