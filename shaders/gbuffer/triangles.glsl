// The triangles of a mesh.

// Indices of the corners; the number of the smooth surface, from 1 on, and from bit 21 on the logarithm
// of the curvature.
uniform usampler2D triangle_corners;

const uint TABLE_COLUMNS = 2048u;   // of simgl/gpu/mesh_tables.py

ivec2 table_place(uint row) {
    return ivec2(row % TABLE_COLUMNS, row / TABLE_COLUMNS);
}

uvec4 corners_of(uint triangle) {
    return texelFetch(triangle_corners, table_place(triangle), 0);
}

// How fast the normals turn over a triangle [rad/m].
float curvature_of(uvec4 corners) {
    return exp2(float(corners.w >> 21u) / 32.0 - 16.0);
}
