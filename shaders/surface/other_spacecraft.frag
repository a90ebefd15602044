// Leaves out the samples that see one spacecraft.
#include "block/spacecraft"

uniform sampler2D gbuffer_position;

void main() {
    float label = texelFetch(gbuffer_position, ivec2(gl_FragCoord.xy), 0).w;
    if (label >= 0.0 && uint(label) / 16384u == instance) discard;
}
