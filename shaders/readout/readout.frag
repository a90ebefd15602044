// From mean electrons to digital numbers, four neighbouring pixels of a row at a time.
//
//     light * gain + dark -> Poisson -> + hits -> [ spilt charge ] -> min(full well)
//         -> + offset + read noise -> floor(* DN per electron + pedestal)
//
// Each map is compiled in where the camera has what it holds. COLLECT stops before the full well, for
// charge that spills into other pixels; SPILT takes up from there.
#include "block/detector"
#include "common/philox.glsl"
#include "readout/poisson.glsl"

#ifdef SPILT
uniform sampler2D spilt_electrons;
#else
uniform sampler2D mean_electrons;
#endif
#ifdef GAIN_MAP
uniform sampler2D gain_map;
#endif
#ifdef DARK_MAP
uniform sampler2D dark_map;
#endif
#ifdef OFFSET_MAP
uniform sampler2D offset_map;
#endif
#ifdef ROW_OFFSETS
uniform sampler2D row_offsets;
#endif
#ifdef HITS
uniform sampler2D hits;
#endif

#ifdef COLLECT
out vec4 electrons;
#else
out uvec4 dn;
#endif

// Every noise source has its own stream, so that leaving one out changes no other.
const uint SHOT = 1u, READ = 2u;

// A random number in (0, 1) for each of the four pixels in this frame.
vec4 random(uint stream) {
    uint group = uint(gl_FragCoord.x) + (uint(gl_FragCoord.y) << 16u);
    return uniform_01(philox(uvec4(group, image_draw, frame), uvec2(seed, stream ^ camera_salt)));
}

#ifdef SPILT
vec4 collected() {
    return texelFetch(spilt_electrons, ivec2(gl_FragCoord.xy), 0);
}
#else
vec4 collected() {
    ivec2 group = ivec2(gl_FragCoord.xy);
    vec4 mean = texelFetch(mean_electrons, group, 0);
#ifdef GAIN_MAP
    mean *= texelFetch(gain_map, group, 0);
#endif
    mean += dark_electrons;
#ifdef DARK_MAP
    mean += exposure_time * texelFetch(dark_map, group, 0);
#endif
    // Far beyond the full well the count no longer matters, and stays an exact float.
    vec4 count = poisson(clamp(mean, 0.0, 1e7), random(SHOT));
#ifdef HITS
    count += texelFetch(hits, group, 0);
#endif
    return count;
}
#endif

void main() {
#ifdef COLLECT
    electrons = collected();
#else
    vec4 signal = min(collected(), full_well);
#ifdef OFFSET_MAP
    signal += texelFetch(offset_map, ivec2(gl_FragCoord.xy), 0);
#endif
#ifdef ROW_OFFSETS
    signal += texelFetch(row_offsets, ivec2(0, int(gl_FragCoord.y)), 0).r;
#endif
    signal += read_noise * normal(random(READ));
    dn = uvec4(clamp(floor(signal * gain_dn_per_e + pedestal), 0.0, largest_dn));
#endif
}
