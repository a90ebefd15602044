// The cells and layers of shading points.
#include "common/texels.glsl"
#include "gbuffer/page_places.glsl"

#ifdef GROUPED
// 0 where there is no page; else bit 31, with bit 30 WIDE, from bit 26 on the layer, from bit 13 on the row
// and below it the column of the first block.
uniform usampler2D page_entries;

// The cell of a shading point; on a wide page the first of those that it stands for.
//
// width : of these along an edge
ivec2 cell_of_point(ivec2 at, out int width) {
    uint entry = read_texel(page_entries, entry_of_point(at)).r;
    width = (entry & WIDE) != 0u ? 1 << int(entry >> 26u & 15u) : 1;
    return BLOCK * ivec2(entry & 8191u, (entry >> 13u) & 8191u) + width * (at & 1);
}

ivec2 cell_of_point(ivec2 at) {
    int width;
    return cell_of_point(at, width);
}

// The same, with its layer; whether there is any.
bool cell_of_point(ivec2 at, out ivec2 cell, out int layer, out int width) {
    uint entry = read_texel(page_entries, entry_of_point(at)).r;
    layer = int(entry >> 26u) & 15;
    cell = cell_of_point(at, width);
    return entry != 0u && all(lessThan(cell, cells));
}
#endif
