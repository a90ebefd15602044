// How many layers each block of cells has.
#include "gbuffer/cells.glsl"

uniform usampler2D more_groups;

out uint layers;

void main() {
    ivec2 first = BLOCK * ivec2(gl_FragCoord.xy), last = min(first + BLOCK, cells);
    layers = 0u;
    for (int y = first.y; y < last.y; ++y)
        for (int x = first.x; x < last.x; ++x)
            layers = max(layers, texelFetch(more_groups, ivec2(x, y), 0).x >> TEXELS);
}
