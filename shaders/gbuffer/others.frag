// Leaves out the shading points of one spacecraft.
#define GROUPED
#include "block/spacecraft"
#include "gbuffer/cells.glsl"

uniform usampler2D visibility;

void main() {
    ivec2 cell;
    uint group = group_of(ivec2(gl_FragCoord.xy), cell);
    bool own = false;
    WHEN(group != 0u) {
        ivec2 texel = first_texel(cell) + next_texel(group);
        own = texelFetch(visibility, texel, 0).g >> 22u == instance;
    }
    if (own) discard;
}
