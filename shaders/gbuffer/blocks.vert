// Squares of cells over the layers of a tile's shading points, at a depth -1..1; those of layers that
// no cell of a square has are left out. Six vertices each.
#include "gbuffer/blocks.glsl"

uniform usampler2D block_layers;

void main() {
    ivec2 blocks = (cells + BLOCK - 1) / BLOCK;
    int block = gl_VertexID / 6, corner = gl_VertexID % 6, layer = block / (blocks.x * blocks.y);
    block -= layer * blocks.x * blocks.y;
    ivec2 at = ivec2(block % blocks.x, block / blocks.x);
    gl_Position = vec4(2.0, 2.0, AT_DEPTH, 1.0);
    if (layer >= int(texelFetch(block_layers, at, 0).r)) return;
    ivec2 side = ivec2(corner == 1 || corner == 2 || corner == 4, corner == 2 || corner > 3);
    ivec2 place = min(BLOCK * (at + side), cells) + ivec2(0, layer * cells.y);
    gl_Position.xy = 2.0 * vec2(place) / vec2(cells.x, LAYERS * cells.y) - 1.0;
}
