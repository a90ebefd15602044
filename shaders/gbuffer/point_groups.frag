// The group of each shading point, 0 where there is none: looked up once for all passes over the points.
#define GROUPED
#include "gbuffer/cells.glsl"

out uint group;

void main() {
    ivec2 cell;
    int layer;
    bool present = cell_of_point(ivec2(gl_FragCoord.xy), cell, layer);
    uint samples = group_at(clamp(cell, ivec2(0), cells - 1), layer) & ((1u << TEXELS) - 1u);
    group = present ? samples : 0u;
}
