// The triangles of a mesh.
#include "common/texels.glsl"

uniform usampler2D triangle_corners;    // indices of the corners; material
// Of each triangle that is drawn, the mesh's that it is, or is a part of. The number of the smooth surface,
// from 1 on; from bit 21 on the curvature, the upper bits of a float from 2^-16 on.
uniform usampler2D drawn_triangles;

const uint TABLE_COLUMNS = 2048u;   // of simgl/gpu/mesh_tables.py

ivec2 table_place(uint row) {
    return ivec2(row % TABLE_COLUMNS, row / TABLE_COLUMNS);
}

uvec3 corners_of(uint triangle) {
    return read_texel(triangle_corners, table_place(triangle)).xyz;
}

uint material_of_triangle(uint triangle) {
    return read_texel(triangle_corners, table_place(triangle)).w;
}

// The number of the smooth surface of a triangle that is drawn.
//
// triangle : its number in the mesh; curvature : how fast the normals turn over it [rad/m]
uint surface_of(uint drawn, out uint triangle, out float curvature) {
    uvec2 row = read_texel(drawn_triangles, table_place(drawn)).rg;
    triangle = row.x;
    curvature = uintBitsToFloat(((row.y >> 21u) << 17u) + (111u << 23u));
    return row.y & 0x1fffffu;
}
