// A tile's corner from that of the image [pixels], by its index (simgl/gpu/tile_quads.py).
vec2 tile_corner() {
    int place = gl_VertexID % TILE_SIZE;
    return vec2(place % TILE_ROW, place / TILE_ROW) * float(LARGEST_TILE >> (gl_VertexID / TILE_SIZE));
}
