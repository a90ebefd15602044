// From mean electrons to digital numbers: shot noise, full well, read noise, converter.
#include "block/detector"
#include "detector/poisson.glsl"

uniform sampler2D mean_electrons;

out uint dn;

// Every noise source has its own stream, so that leaving one out changes no other.
const uint SHOT = 1u, READ = 2u;

// Random words of this pixel in this frame.
uvec4 bits(uint stream) {
    uint pixel = uint(gl_FragCoord.x) + (uint(gl_FragCoord.y) << 16u);
    return philox(uvec4(pixel, 0u, frame), uvec2(seed, stream ^ camera_salt));
}

void main() {
    float mean = texelFetch(mean_electrons, ivec2(gl_FragCoord.xy), 0).r;
    // Far beyond the full well the count no longer matters, and stays an exact float.
    float collected = mean > 0.0 ? poisson(min(mean, 1e7), bits(SHOT).xyz) : 0.0;
    float signal = min(collected, full_well) + read_noise * gaussian(bits(READ).xy);
    dn = uint(clamp(floor(signal * gain_dn_per_e + pedestal), 0.0, largest_dn));
}
