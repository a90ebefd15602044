// Cells of a tile: squares of about a pixel that hold a few samples of its raster. Samples of a cell
// that see the same smooth surface are a group, and share one shading point.
//
// A group is a set of texels of the cell's window: bit 5 * row + column.
#include "block/tile"
#include "gbuffer/paging.glsl"

const int STRIDE = 5;   // texels along the edge of the largest window
const int TEXELS = STRIDE * STRIDE;   // the bits above tell of the cell
const uint BARE = 1u << 30u;   // with the second group: a sample of the cell sees nothing
const uint ONE_SURFACE = 1u << 29u;   // with it, too: all texels of the window see one smooth surface
// With the number of pages of a block (gbuffer/pages.frag): the same of all its cells, or any.
const uint BLOCK_ONE_SURFACE = 32u, BLOCK_BARE = 128u;

// From the texel alone, so that neighbouring cells agree on whose sample it is.
ivec2 cell_of(ivec2 texel) {
    mat2 to_cell = mat2(cell_from_raster.xy, cell_from_raster.zw);
    return ivec2(floor(to_cell * (vec2(texel) + 0.5 - raster_origin)));
}

// Where a place among the cells lies in the raster.
vec2 raster_place(vec2 cell) {
    return mat2(raster_from_cell.xy, raster_from_cell.zw) * cell + raster_origin;
}

// The texel at the corner of a cell's window.
ivec2 first_texel(ivec2 cell) {
    return ivec2(ceil(raster_place(vec2(cell) + 0.5) - cell_reach - 0.5));
}

// The line of sight through a place of the raster, at depth 1.
vec3 sight_at(vec2 place) {
    return sight_origin.xyz + place.x * sample_steps[0].xyz + place.y * sample_steps[1].xyz;
}

// Step of the place from one sample to the next, on a triangle's plane, camera axes [m].
//
// place : [m]; facet : unit normal of the triangle, on the viewer's side
// step : of the line of sight at depth 1. A place is its depth times its line of sight, and stays
// on the plane.
vec3 place_step(vec3 place, vec3 facet, vec3 step) {
    float off_plane = min(dot(facet, place), -1e-6 * length(place));
    return place.z * (step - place * (dot(facet, step) / off_plane));
}

uint samples_of(uint group) {
    uint bits = group & ((1u << TEXELS) - 1u);
    bits -= (bits >> 1u) & 0x55555555u;
    bits = (bits & 0x33333333u) + ((bits >> 2u) & 0x33333333u);
    bits = (bits + (bits >> 4u)) & 0x0f0f0f0fu;
    return (bits * 0x01010101u) >> 24u;
}

uint lowest_of(uint group) {
    return group & (~group + 1u);
}

// Takes one texel out of a group; its place in the window.
ivec2 next_texel(inout uint group) {
    uint lowest = lowest_of(group);
    group ^= lowest;
    int bit = (floatBitsToInt(float(lowest)) >> 23) - 127;
    // A fifth, exact for all bits there are.
    int row = (bit * 13) >> 6;
    return ivec2(bit - STRIDE * row, row);
}

#ifdef GROUPED
// Four layers each. Above the first group stands the number of samples, above the second that of groups.
uniform usampler2D cell_groups, second_groups, third_groups, fourth_groups;

// How many groups a cell has, by its first four.
int count_of(uvec4 groups) {
    return int((groups.y & ~(BARE | ONE_SURFACE)) >> TEXELS);
}

// The groups of four layers of a cell, from a multiple of four on.
uvec4 groups_from(ivec2 cell, int layer) {
    uvec4 groups = read_texel(cell_groups, cell);
    // Few cells have more. A loop, which llvmpipe leaves where an if would be worked out.
    for (bool more = layer >= 4; more; more = false) {
        groups = read_texel(second_groups, cell);
        if (layer >= 8) groups = read_texel(third_groups, cell);
        if (layer >= 12) groups = read_texel(fourth_groups, cell);
    }
    return groups;
}

// A group of a cell, with what is above it.
uint group_at(ivec2 cell, int layer) {
    uvec4 groups = groups_from(cell, layer);
    int place = layer & 3;
    return place == 0 ? groups.x : place == 1 ? groups.y : place == 2 ? groups.z : groups.w;
}

// Of each shading point its group, 0 where there is none (gbuffer/point_groups.frag).
uniform usampler2D point_groups;

uint group_of(ivec2 at) {
    return read_texel(point_groups, at).r;
}

// Where a group's shading point lies in the window: the mean of its samples' middles.
vec2 point_of(uint group) {
    vec2 sum = vec2(0.0);
    uint left = group;
    do sum += vec2(next_texel(left)) + 0.5; while (left != 0u);
    return sum / float(samples_of(group));
}
#endif
