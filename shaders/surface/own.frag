// Leaves out the samples that see one spacecraft.
#include "block/craft"

uniform sampler2D seen_place;

void main() {
    float label = texelFetch(seen_place, ivec2(gl_FragCoord.xy), 0).w;
    if (label >= 0.0 && uint(label) / 16384u == instance) discard;
}
