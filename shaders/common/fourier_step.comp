// One step of a Fourier transform along the rows or the columns of layers of complex values, by the
// method of Stockham: each invocation transforms RADIX values that lie as far from each other as
// possible, and writes them in the order in which the next step needs them.
#include "common/group.glsl"
#include "common/complex.glsl"

layout(std430, binding = 0) readonly buffer Source { vec2 source[]; };
layout(std430, binding = 1) writeonly buffer Result { vec2 result[]; };
// exp(-2 pi i k / n) for k below the length n of a transform: the functions of a GPU are too rough.
layout(std430, binding = 2) readonly buffer Roots { vec2 roots[]; };

uniform ivec2 size;   // columns and rows of a layer
uniform int done;     // the product of the radices of the steps before
uniform float sense;  // 1 for the transform, -1 for its inverse, which is not scaled

vec2 root(int k) { return vec2(roots[k].x, sense * roots[k].y); }

void main() {
    ivec3 place = ivec3(gl_GlobalInvocationID);
    int layer = place.z * size.x * size.y;
#ifdef ALONG_ROWS
    int count = size.x, part = place.x, line = place.y, lines = size.y;
    int first = layer + line * size.x, stride = 1;
#else
    int count = size.y, part = place.y, line = place.x, lines = size.x;
    int first = layer + line, stride = size.x;
#endif
    int parts = count / RADIX;
    if (part >= parts || line >= lines) return;
    vec2 sums[RADIX];
    for (int q = 0; q < RADIX; ++q) sums[q] = vec2(0.0);
    int inner = part % done, angle = inner * (parts / done);
    for (int r = 0; r < RADIX; ++r) {
        vec2 value = complex_product(source[first + stride * (part + r * parts)], root(angle * r));
        int k = 0;
        for (int q = 0; q < RADIX; ++q) {
            sums[q] += complex_product(value, root(k * parts));
            k += r;
            if (k >= RADIX) k -= RADIX;
        }
    }
    int begin = (part - inner) * RADIX + inner;
    for (int q = 0; q < RADIX; ++q) result[first + stride * (begin + q * done)] = sums[q];
}
