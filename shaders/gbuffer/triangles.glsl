// The triangles of a mesh.

// Indices of the corners; the number of the smooth surface, from 1 on.
uniform usampler2D triangle_corners;

const uint TABLE_COLUMNS = 2048u;   // of simgl/gpu/mesh_tables.py

ivec2 table_place(uint row) {
    return ivec2(row % TABLE_COLUMNS, row / TABLE_COLUMNS);
}

uvec4 corners_of(uint triangle) {
    return texelFetch(triangle_corners, table_place(triangle), 0);
}
