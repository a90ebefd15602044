// Upper 32 bits of each product, from 16-bit halves (umulExtended needs GLSL 4.00).
uvec2 high_product(uvec2 a, uvec2 b) {
    uvec2 a_low = a & 0xFFFFu, a_high = a >> 16u, b_low = b & 0xFFFFu, b_high = b >> 16u;
    uvec2 middle = a_high * b_low + ((a_low * b_low) >> 16u);
    uvec2 cross_sum = a_low * b_high + (middle & 0xFFFFu);
    return a_high * b_high + (middle >> 16u) + (cross_sum >> 16u);
}

// Counter-based random bits: Philox4x32-10 (Salmon et al., SC 2011). No state and no order: the same
// counter and key give the same bits on every machine.
uvec4 philox(uvec4 counter, uvec2 key) {
    const uvec2 multiplier = uvec2(0xD2511F53u, 0xCD9E8D57u);
    for (int round = 0; round < 10; ++round) {
        uvec2 high = high_product(multiplier, counter.xz);
        uvec2 low = multiplier * counter.xz;
        counter = uvec4(high.y ^ counter.y ^ key.x, low.y, high.x ^ counter.w ^ key.y, low.x);
        key += uvec2(0x9E3779B9u, 0xBB67AE85u);
    }
    return counter;
}

// Uniform in (0, 1), exact in float32 and never 0 or 1.
float uniform_01(uint bits) {
    return (float(bits >> 9u) + 0.5) * (1.0 / 8388608.0);
}

// Standard normal by Box and Muller; |z| < 5.8.
float gaussian(uvec2 bits) {
    float radius = sqrt(-2.0 * log(uniform_01(bits.x)));
    return radius * cos(6.28318530718 * uniform_01(bits.y));
}
