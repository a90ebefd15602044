// Weighted sums of the bands of an image, each in a target of its own.
#include "block/spread"

uniform sampler2D bands;

layout(location = 0) out float first;
layout(location = 1) out float second;
layout(location = 2) out float third;
layout(location = 3) out float fourth;

void main() {
    vec4 sums = mixture * texelFetch(bands, ivec2(gl_FragCoord.xy), 0);
    first = sums.x;
    second = sums.y;
    third = sums.z;
    fourth = sums.w;
}
