// The depths of a map side by side, so that one texel tells all of a place: where the light meets the
// casters, where it leaves them again, and where it would meet the next surface behind.
#include "block/slabs"

uniform sampler2D depths;   // nearest, and below them where the light leaves
uniform sampler2D behind;

out vec4 slabs;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    float left = texelFetch(depths, at + ivec2(0, int(map_size)), 0).r;
    slabs = vec4(texelFetch(depths, at, 0).r, left, texelFetch(behind, at, 0).r, 0.0);
}
