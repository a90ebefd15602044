// Grids on triangles over which light of other surfaces is far from linear (simgl/radiosity/light_grids.py).

uniform usampler2D light_grids;   // of each triangle 1 and the number of its grid, 0 without one
uniform usampler2D grid_rows;     // of each node and side the row of its light
uniform sampler2D grid_light;     // irradiance [W m-2] more than is linear

const uint GRID_CUTS = 4u;
const uint GRID_NODES = 15u;

// A node by how many parts of the edges it lies from the third corner towards the first and second.
vec4 grid_node(uint grid, uint i, uint j, bool back) {
    uint node = i * (2u * GRID_CUTS + 3u - i) / 2u + j;
    uint row = read_texel(grid_rows, table_place((grid * GRID_NODES + node) * SIDES + uint(back) % SIDES)).r;
    return read_texel(grid_light, table_place(row));
}

// A place on a grid, between three nodes.
struct GridPlace {
    uint i, j;    // of a square of nodes
    vec2 part;    // place there
    bool upper;   // in which of its two triangles
};

// At weights of a triangle's corners.
GridPlace grid_place(vec3 weights) {
    vec2 at = weights.xy * float(GRID_CUTS);
    uint i = min(uint(at.x), GRID_CUTS - 1u), j = min(uint(at.y), GRID_CUTS - 1u - i);
    vec2 part = clamp(at - vec2(i, j), 0.0, 1.0);
    return GridPlace(i, j, part, part.x + part.y > 1.0 && i + j < GRID_CUTS - 1u);
}

// Whether between two places the light of a grid is linear.
bool is_linear(GridPlace a, GridPlace b) {
    return a.i == b.i && a.j == b.j && a.upper == b.upper;
}

// Irradiance [W m-2] more than is linear between a triangle's vertices, at weights of its corners.
vec4 more_of_grid(uint triangle, vec3 weights, bool back) {
    uint number = read_texel(light_grids, table_place(triangle)).r;
    GridPlace at = grid_place(weights);
    uint i = at.i, j = at.j;
    vec2 part = at.part;
    bool upper = at.upper;
    // Weights of the three nodes.
    vec2 lower = part / max(part.x + part.y, 1.0);
    vec3 share = upper ? vec3(1.0 - part.yx, part.x + part.y - 1.0) : vec3(lower, 1.0 - lower.x - lower.y);
    uint third = uint(upper);
    vec4 more = share.x * grid_node(number - 1u, i + 1u, j, back)
              + share.y * grid_node(number - 1u, i, j + 1u, back)
              + share.z * grid_node(number - 1u, i + third, j + third, back);
    return number == 0u ? vec4(0.0) : more;
}
