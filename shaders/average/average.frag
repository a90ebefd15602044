// A share of a snapshot.
#include "block/average"

uniform sampler2D snapshot;

out vec4 radiance;

void main() {
    radiance = share * texelFetch(snapshot, ivec2(gl_FragCoord.xy), 0);
}
