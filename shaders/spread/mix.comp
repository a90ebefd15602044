// From the spectra of inputs, two as one complex layer, to those of results, two as one: each input
// is multiplied by the spectrum of its kernel and counts in each result by its share.
#include "common/group.glsl"
#include "common/complex.glsl"

layout(std430, binding = 0) readonly buffer Spectra { vec2 spectra[]; };
layout(std430, binding = 1) writeonly buffer Mixed { vec2 mixed[]; };
// (INPUTS, rows, columns / 2 + 1): of a real kernel the other half follows from this one.
layout(std430, binding = 2) readonly buffer Kernels { vec2 kernels[]; };
layout(std430, binding = 3) readonly buffer Shares { vec4 shares[]; };  // of each input in each result
uniform ivec2 size;  // of a layer

// What one of the two inputs of a layer adds to the spectrum z here, and to the opposite one.
vec2 spectrum_of(int input_, vec2 z, vec2 opposite) {
    return 0.5 * (input_ % 2 == 0 ? vec2(z.x + opposite.x, z.y - opposite.y)
                                  : vec2(z.y + opposite.y, opposite.x - z.x));
}

void main() {
    ivec2 k = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(k, size))) return;
    ivec2 minus_k = ivec2(k.x == 0 ? 0 : size.x - k.x, k.y == 0 ? 0 : size.y - k.y);
    int here = k.y * size.x + k.x, there = minus_k.y * size.x + minus_k.x;
    int layer = size.x * size.y, known_columns = size.x / 2 + 1;
    bool known = k.x < known_columns;
    int kernel = (known ? k.y : minus_k.y) * known_columns + (known ? k.x : minus_k.x);
    vec4 real = vec4(0.0), imaginary = vec4(0.0);  // by result
    for (int i = 0; i < INPUTS; ++i) {
        int first = i / 2 * layer;
        vec2 transfer = kernels[i * size.y * known_columns + kernel];
        if (!known) transfer.y = -transfer.y;
        vec2 value = spectrum_of(i, spectra[first + here], spectra[first + there]);
        value = complex_product(value, transfer);
        real += shares[i] * value.x;
        imaginary += shares[i] * value.y;
    }
    mixed[here] = vec2(real.x - imaginary.y, imaginary.x + real.y);
#if RESULTS > 2
    mixed[layer + here] = vec2(real.z - imaginary.w, imaginary.z + real.w);
#endif
}
