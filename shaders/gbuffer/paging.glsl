// Where shading points lie in the textures that hold them: page by page. A page holds the points of one
// layer of a block of 2 x 2 cells; only pages that are needed are there (simgl/passes/shading_points.py).
//
// Four pages fill a square of 4 x 4 texels, so that neighbours stay together.

const int LAYERS = 16;   // groups that a cell may have: no cell has more samples
const int BLOCK = 2;     // cells along an edge
const int SQUARES = 256; // along a row of the textures


// The texel of a page's first point.
ivec2 texel_of_page(int page) {
    int square = page >> 2;
    return 4 * ivec2(square & (SQUARES - 1), square / SQUARES) + 2 * ivec2(page & 1, (page >> 1) & 1);
}

#ifdef GROUPED
// 0 where there is no page; else bit 31, from bit 26 on the layer, from bit 13 on the row and below it
// the column of the block.
uniform usampler2D page_entries;

// The cell and layer of a shading point; whether there is any.
bool cell_of_point(ivec2 at, out ivec2 cell, out int layer) {
    ivec2 square = at >> 2, quarter = (at >> 1) & 1;
    uint entry = texelFetch(page_entries, ivec2(4 * square.x + 2 * quarter.y + quarter.x, square.y), 0).r;
    layer = int(entry >> 26u) & 15;
    cell = BLOCK * ivec2(entry & 8191u, (entry >> 13u) & 8191u) + (at & 1);
    return entry != 0u && all(lessThan(cell, cells));
}
#endif
