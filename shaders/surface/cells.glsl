// A pattern of solar cells, filtered over the sample's footprint, so that its mean is the same at
// any distance.

// Share of a box of `width` about `x` that lies in lines, the first from 0 to `line`, one in each
// `pitch`; all in metres.
float line_share(float x, float width, float pitch, float line) {
    if (line <= 0.0) return 0.0;
    // A box narrower than a thousandth of the pitch would be lost in the rounding of its ends.
    float half_box = 0.5 * max(width / pitch, 1e-3);
    float middle = fract(x / pitch), part = line / pitch;
    float low = middle - half_box, high = middle + half_box;
    float below_low = floor(low) * part + min(fract(low), part);
    float below_high = floor(high) * part + min(fract(high), part);
    return (below_high - below_low) / (high - low);
}

// Shares of a footprint that cells and the metal lines on them take, cells without lines first.
//
// place : body axes [m]; box : width of the footprint along each axis [m]; n : body axes
// cells : width, height, gap; lines : pitch and width of fingers, then of busbars [m]
vec2 cell_shares(vec3 place, vec3 box, vec3 n, vec3 cells, vec4 lines) {
    vec3 facing = abs(n);
    bool along_x = facing.x >= max(facing.y, facing.z);
    bool along_z = !along_x && facing.z > facing.y;
    vec2 uv = along_x ? place.yz : along_z ? place.xy : place.xz;
    vec2 w = along_x ? box.yz : along_z ? box.xy : box.xz;
    float cell = (1.0 - line_share(uv.x, w.x, cells.x + cells.z, cells.z))
               * (1.0 - line_share(uv.y, w.y, cells.y + cells.z, cells.z));
    float bare = (1.0 - line_share(uv.x, w.x, lines.x, lines.y))
               * (1.0 - line_share(uv.y, w.y, lines.z, lines.w));
    return cell * vec2(bare, 1.0 - bare);
}
