// The planes of a lens on the coarse grid, means over a cell, two planes as one complex layer with
// black surroundings. Each pixel is distributed to the cells around it by the weights of linear
// interpolation, which keeps the centroid of light.
#include "common/group.glsl"
#include "spread/plane.glsl"
#include "spread/between_cells.glsl"

layout(std430, binding = 0) readonly buffer Planes { Plane planes[]; };
layout(std430, binding = 1) readonly buffer Illumination { float illumination[]; };
layout(std430, binding = 2) writeonly buffer Layers { vec2 layers[]; };
uniform ivec2 size;  // of a layer

void main() {
    ivec2 cell = ivec2(gl_GlobalInvocationID.xy), seen = textureSize(radiance, 0);
    if (any(greaterThanEqual(cell, size))) return;
    float sums[PLANES];
    for (int p = 0; p < PLANES; ++p) sums[p] = 0.0;
    ivec2 cells = cells_of(seen);
    if (all(lessThan(cell, cells))) {
        // All pixels from the centre of the cell before to that of the next.
        ivec2 low = max(cell * CELL - CELL / 2, 0), high = min(cell * CELL + 3 * CELL / 2, seen);
        for (int y = low.y; y < high.y; ++y) {
            for (int x = low.x; x < high.x; ++x) {
                vec2 near = 1.0 - abs(among_cells(vec2(x, y), cells) - vec2(cell));
                float share = max(near.x, 0.0) * max(near.y, 0.0) / float(CELL * CELL);
                vec4 light = texelFetch(radiance, ivec2(x, y), 0);
                float lit = illumination[y * seen.x + x];
                for (int p = 0; p < PLANES; ++p) sums[p] += share * plane_at(light, planes[p], lit);
            }
        }
    }
    for (int p = 0; p < PLANES; p += 2) {
        vec2 pair = vec2(sums[p], p + 1 < PLANES ? sums[min(p + 1, PLANES - 1)] : 0.0);
        layers[(p / 2 * size.y + cell.y) * size.x + cell.x] = pair;
    }
}
