#extension GL_ARB_gpu_shader5 : enable

// Upper 32 bits of each product; from 16-bit halves on a driver that knows only GLSL 3.30, or where
// the reference compiler, which lacks this function of the extension, checks that path.
uvec2 high_product(uvec2 a, uvec2 b) {
#if defined(GL_ARB_gpu_shader5) && !defined(ONLY_GLSL_330)
    uvec2 high, low;
    umulExtended(a, b, high, low);
    return high;
#else
    uvec2 a_low = a & 0xFFFFu, a_high = a >> 16u, b_low = b & 0xFFFFu, b_high = b >> 16u;
    uvec2 middle = a_high * b_low + ((a_low * b_low) >> 16u);
    uvec2 cross_sum = a_low * b_high + (middle & 0xFFFFu);
    return a_high * b_high + (middle >> 16u) + (cross_sum >> 16u);
#endif
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
vec4 uniform_01(uvec4 bits) {
    return (vec4(bits >> 9u) + 0.5) * (1.0 / 8388608.0);
}

// Standard normals by inversion of their distribution at u in (0, 1): Wichura, "Algorithm AS 241"
// (1988), its seven-digit form. One word makes one normal, |z| < 5.3.
vec4 normal(vec4 u) {
    vec4 q = u - 0.5;
    vec4 r = 0.180625 - q * q;
    vec4 middle = q * (((59.109374720 * r + 159.29113202) * r + 50.434271938) * r + 3.3871327179)
        / (((67.187563600 * r + 78.757757664) * r + 17.895169469) * r + 1.0);
    vec4 s = sqrt(-log(min(u, 1.0 - u))) - 1.6;
    vec4 tail = (((0.17023821103 * s + 1.3067284816) * s + 2.7568153900) * s + 1.4234372777)
        / ((0.12021132975 * s + 0.73700164250) * s + 1.0);
    return mix(middle, sign(q) * tail, greaterThan(abs(q), vec4(0.425)));
}
