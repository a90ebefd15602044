// Weighted sums of the bands of an image, each in a target of its own, of four neighbouring pixels of a
// row at a time. PLANES is how many there are, 1 to 4.
#include "block/spread"

uniform sampler2D bands;

layout(location = 0) out vec4 first;
#if PLANES > 1
layout(location = 1) out vec4 second;
#endif
#if PLANES > 2
layout(location = 2) out vec4 third;
#endif
#if PLANES > 3
layout(location = 3) out vec4 fourth;
#endif

void main() {
    ivec2 left = ivec2(4 * int(gl_FragCoord.x), int(gl_FragCoord.y));
    // The last group may reach past the end of the row.
    int last = textureSize(bands, 0).x - 1;
    mat4 pixels = mat4(texelFetch(bands, left, 0), texelFetch(bands, ivec2(min(left.x + 1, last), left.y), 0),
                       texelFetch(bands, ivec2(min(left.x + 2, last), left.y), 0),
                       texelFetch(bands, ivec2(min(left.x + 3, last), left.y), 0));
    mat4 sums = transpose(mixture * pixels);
    first = sums[0];
#if PLANES > 1
    second = sums[1];
#endif
#if PLANES > 2
    third = sums[2];
#endif
#if PLANES > 3
    fourth = sums[3];
#endif
}
