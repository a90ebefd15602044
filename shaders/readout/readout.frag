// From mean electrons to digital numbers of eight neighbouring pixels of a row, two in each word.
//
//     light * gain + dark -> Poisson -> + hits -> [ spilt charge ] -> min(full well)
//         -> + offset + read noise -> floor(* DN per electron + pedestal)
//
// Each map is compiled in where the camera has what it holds. COLLECT stops before the full well, for
// charge that spills into other pixels; SPILT takes up from there.
#include "common/philox.glsl"
#include "common/texels.glsl"
#include "block/detector"
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

#ifdef SPILT
#define ELECTRONS spilt_electrons
#else
#define ELECTRONS mean_electrons
#endif
#endif

// Every noise source has its own stream, so that leaving one out changes no other.
const uint SHOT = 1u, READ = 2u;

// A random number in (0, 1) for each of the four pixels of a group in this frame.
vec4 random(ivec2 group, uint stream) {
    uint place = uint(group.x) + (uint(group.y) << 16u);
    return uniform_01(philox(uvec4(place, image_draw, frame), uvec2(seed, stream ^ camera_salt)));
}

#ifdef SPILT
vec4 collected(ivec2 group) {
    return read_texel(spilt_electrons, group);
}
#else
vec4 collected(ivec2 group) {
    vec4 mean = read_texel(mean_electrons, group);
#ifdef GAIN_MAP
    mean *= read_texel(gain_map, group);
#endif
    mean += dark_electrons;
#ifdef DARK_MAP
    mean += exposure_time * read_texel(dark_map, group);
#endif
#ifdef COLLECT
    // All of it counts: what the well does not hold flows on.
    const float limit = 1e30;
#else
    // Far beyond the full well the count no longer matters, and stays an exact float but for wells
    // beyond 8e6 electrons, whose shot noise is a thousand times the last digit.
    float limit = max(1e7, 2.0 * full_well);
#endif
    vec4 count = poisson(clamp(mean, 0.0, limit), random(group, SHOT));
#ifdef HITS
    count += read_texel(hits, group);
#endif
    return count;
}
#endif

#ifdef COLLECT
void main() {
    electrons = collected(ivec2(gl_FragCoord.xy));
}
#else
uvec4 digital(ivec2 group) {
    vec4 signal = min(collected(group), full_well);
#ifdef OFFSET_MAP
    signal += read_texel(offset_map, group);
#endif
#ifdef ROW_OFFSETS
    signal += read_texel(row_offsets, ivec2(0, group.y)).r;
#endif
    signal += read_noise * normal(random(group, READ));
    return uvec4(clamp(floor(signal * gain_dn_per_e + pedestal), 0.0, largest_dn));
}

void main() {
    ivec2 left = ivec2(2 * int(gl_FragCoord.x), int(gl_FragCoord.y));
    // The last eight pixels may reach past the end of the row.
    ivec2 right = ivec2(min(left.x + 1, textureSize(ELECTRONS, 0).x - 1), left.y);
    uvec4 a = digital(left), b = digital(right);
    dn = uvec4(a.xz | (a.yw << 16u), b.xz | (b.yw << 16u));
}
#endif
