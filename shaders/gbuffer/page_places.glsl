// Where shading points lie in the textures that hold them: page by page. A page holds the points of one
// layer of a block of 2 x 2 cells; only pages that are needed are there (simgl/passes/shading_points.py).
//
// Four pages fill a square of 4 x 4 texels, so that neighbours stay together.

const int LAYERS = 16;   // groups that a cell may have: no cell has more samples
const int BLOCK = 2;     // cells along an edge
const int SQUARES = 256; // along a row of the textures

// With the entry and the number of a page: it is wide. Its four points then stand for a square of 4 x 4 or 8 x 8
// cells, all of which show one surface in smooth light (`even_light` in simgl/passes/sunlight.py). In place of the
// layer, and with the number from WIDTH_BIT on, stands the logarithm of the cells along an edge of each point's part.
const uint WIDE = 1u << 30u, WIDTH_BIT = 28u;

// The first page of a block, of what texels of block_pages hold.
int page_of(uint first_page) {
    return int(first_page & ((1u << WIDTH_BIT) - 1u));
}

// How many cells along an edge each point of such a page stands for.
int width_of(uint first_page) {
    return (first_page & WIDE) != 0u ? 1 << int(first_page >> WIDTH_BIT & 3u) : 1;
}

// The texel of a page's first point.
ivec2 texel_of_page(int page) {
    int square = page >> 2;
    return 4 * ivec2(square & (SQUARES - 1), square / SQUARES) + 2 * ivec2(page & 1, (page >> 1) & 1);
}

// Where the entry of a point's page stands in tables of pages.
ivec2 entry_of_point(ivec2 at) {
    ivec2 square = at >> 2, quarter = (at >> 1) & 1;
    return ivec2(4 * square.x + 2 * quarter.y + quarter.x, square.y);
}

// Which of the listed points a point is (`listed_points` in simgl/passes/shading_points.py).
//
// page : from bit 4 on how many listed points come before its page's, below it which points are listed
int listed_index(uint page, ivec2 at) {
    uint before = page & ((1u << uint(2 * (at.y & 1) + (at.x & 1))) - 1u);
    return int((page >> 4u) + (before & 1u) + (before >> 1u & 1u) + (before >> 2u & 1u));
}
