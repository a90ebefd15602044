// The group of each shading point, 0 where there is none: looked up once for all passes over the points. Those of
// wide pages stand for more than a group: of them it only tells that they are there.
#define GROUPED
#include "gbuffer/cells.glsl"

out uint group;

void main() {
    ivec2 cell;
    int layer, width;
    bool present = cell_of_point(ivec2(gl_FragCoord.xy), cell, layer, width);
    group = present && width > 1 ? 1u : 0u;
    // A loop, which llvmpipe leaves where an if would be worked out.
    for (bool looked_up = present && width == 1; looked_up; looked_up = false)
        group = group_at(cell, layer) & ((1u << TEXELS) - 1u);
}
