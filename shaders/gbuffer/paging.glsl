// The cells and layers of shading points.
#include "common/texels.glsl"
#include "gbuffer/page_places.glsl"

#ifdef GROUPED
// 0 where there is no page; else bit 31, with bit 30 WIDE, from bit 26 on the layer, from bit 13 on the row
// and below it the column of the block.
uniform usampler2D page_entries;

// The cell of a shading point; on a wide page the first of the 2 x 2 that it stands for.
ivec2 cell_of_point(ivec2 at, out bool wide) {
    uint entry = read_texel(page_entries, entry_of_point(at)).r;
    wide = (entry & WIDE) != 0u;
    return BLOCK * ivec2(entry & 8191u, (entry >> 13u) & 8191u) + (wide ? BLOCK : 1) * (at & 1);
}

ivec2 cell_of_point(ivec2 at) {
    bool wide;
    return cell_of_point(at, wide);
}

// The same, with its layer; whether there is any.
bool cell_of_point(ivec2 at, out ivec2 cell, out int layer) {
    uint entry = read_texel(page_entries, entry_of_point(at)).r;
    layer = int(entry >> 26u) & 15;
    cell = cell_of_point(at);
    return entry != 0u && all(lessThan(cell, cells));
}
#endif
