// The depths of a map side by side, so that one texel tells where the light meets the casters and where it
// leaves them again.
#include "block/slabs"
#include "common/texels.glsl"

uniform sampler2D depths;   // nearest, and below them where the light leaves

out vec2 slabs;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    slabs = vec2(read_texel(depths, at).r, read_texel(depths, at + ivec2(0, int(map_size))).r);
}
