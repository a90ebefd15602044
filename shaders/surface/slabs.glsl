// Casters over a receiver as slabs, and whether a line to the Sun meets one (surface/shadow.glsl).

#include "common/texels.glsl"
#include "surface/receiver.glsl"

// Depths at a texel of a map: where the light meets the casters, and where it leaves them again.
//
// With SLABS a texel of the texture holds both (shadow/slabs.frag).
vec2 depths_at(sampler2D depths, SunMap map, ivec2 at) {
    ivec2 place = at + ivec2(map.column, 0);
#ifdef SLABS
    return read_texel(depths, place, map.width).rg;
#else
    return vec2(read_texel(depths, place).r, read_texel(depths, place + ivec2(0, map.size)).r);
#endif
}

// Depth at which it would meet the next surface behind.
float depth_behind(sampler2D behind, SunMap map, ivec2 at) {
    return read_texel(behind, at + ivec2(map.column, 0)).r;
}

// The casters over a receiver at one texel: heights [m] above the receiver.
struct Slab {
    float high, low;
    bool casts;
    bool ends;     // above the receiver
    bool beyond;   // it shows neither a caster nor the receiver's own surface
    bool step;     // it shows a low step
    float plane;   // of the receiver's own surface
};

// The texel at an offset [texels] from a receiver.
ivec2 texel_at(SunMap map, Receiver r, vec2 offset) {
    return clamp(ivec2(r.here.xy + offset), ivec2(0), ivec2(map.size - 1));
}

// What stands over the receiver at an offset [texels] from it.
Slab slab_at(sampler2D depths, SunMap map, Receiver r, vec2 offset) {
    ivec2 at = texel_at(map, r, offset);
    vec2 heights = map.top - r.here.z - map.depth * depths_at(depths, map, at);
    Slab slab;
    slab.high = heights.x;
    // The texel tells of its middle.
    vec2 middle = vec2(at) + 0.5 - r.here.xy;
    float plane = receiver_plane(r, middle);
    slab.plane = plane;
    slab.casts = slab.high > plane;
    slab.beyond = !SOLID && !slab.casts && beyond_receiver(r, slab.high, plane, middle);
    slab.low = slab.high;
    slab.ends = true;
    slab.step = false;
    if (slab.casts) {
        float low = heights.y;
        // No end above the receiver: a sheet, or a solid that the receiver's own body runs into.
        slab.ends = low >= plane;
        slab.low = min(slab.ends ? low : plane, slab.high);
        slab.step = SOLID && !slab.ends && slab.high - plane < r.step;
        slab.casts = !slab.step;
    }
    return slab;
}

// What stands there below a slab, its lower end unknown: a solid is taken to reach the receiver.
Slab slab_behind(sampler2D behind, SunMap map, Receiver r, Slab slab, vec2 offset) {
    float high = map.top - r.here.z - map.depth * depth_behind(behind, map, texel_at(map, r, offset));
    float plane = slab.plane;
    bool step = SOLID && high > plane && high - plane < r.step;
    float low = SOLID ? min(plane, high) : high;
    return Slab(high, low, high > plane && !step, false, false, step, plane);
}

const Slab NO_SLAB = Slab(0.0, 0.0, false, false, true, false, 0.0);

// What stands over the receiver at the nearest of the four texels around it that its surface reaches.
Slab overhead_slab(sampler2D depths, SunMap map, Receiver r) {
    vec2 first = floor(r.here.xy - 0.5) + 0.5 - r.here.xy;
    Slab overhead = NO_SLAB;
    float nearest2 = 2.0;
    for (int k = 0; k < 4; ++k) {
        vec2 offset = first + vec2(k & 1, k >> 1);
        Slab slab = slab_at(depths, map, r, offset);
        float away2 = dot(offset, offset);
        bool nearer = !slab.beyond && away2 < nearest2;
        if (nearer) overhead = slab;
        nearest2 = nearer ? away2 : nearest2;
    }
    return overhead;
}

// What stands over the receiver at an offset [texels]; near the receiver, where the texel lies beyond
// its surface, what stands over the receiver itself.
Slab slab_near(sampler2D depths, SunMap map, Receiver r, Slab overhead, vec2 offset) {
    Slab slab = slab_at(depths, map, r, offset);
    Slab near = slab;
    if (slab.beyond && dot(offset, offset) < 4.0) near = overhead;
    near.plane = slab.plane;
    return near;
}

// A line meets a slab that ends so little over or under it, as a part of its height: a penumbra is so much
// wider or narrower there.
const float MISS = 0.05;

// The casters that a receiver's Sun meets: heights over the receiver [m].
struct Casters {
    float top, bottom;
    float lower_top;   // of those that are lower than where all lines were tried
    bool tall;         // others are as high as that
};

// How far from the line to the Sun's middle the disc's edge is at a height [texels]. Near contact the disc
// shrinks below a texel; then the texel's own width smooths.
//
// reach : texels per metre of height at the disc's edge
float spread_at(float height, float reach) { return sqrt(height * height * reach * reach + 0.6); }

// Whether a line that comes over a slab at a height [m] meets it there.
bool is_within(Slab slab, float height) {
    return abs(clamp(height, slab.low, slab.high) - height) <= MISS * height;
}

// Whether a line from the receiver meets a slab, from its first look down.
//
// ray, reach : texels per metre of height, of this line and at the disc's edge
// past_tall : it has been tried as high as casters are tall, and met nothing
//
// Below a slab that floats over the line it asks for what is behind. Where a low step is, it ends where
// others do.
bool met_by_line(sampler2D depths, sampler2D behind, SunMap map, Receiver r, Slab overhead, vec2 ray,
                 float reach, Casters casters, bool past_tall) {
    float height = past_tall ? casters.bottom : casters.lower_top, before = 0.0, off_before = 0.0;
    bool lowest = past_tall;
    int looks = SOLID ? 3 : 4;
    for (int look = 0; look < looks; ++look) {
        float wider = sqrt(1.0 + 0.6 / max(height * height * reach * reach, 1e-6));
        vec2 offset = height * (map.lean + wider * ray);
        Slab slab = slab_near(depths, map, r, overhead, offset);
        bool over = slab.casts && slab.low > (1.0 + MISS) * height;
        if (over) {
            Slab next = slab_behind(behind, map, r, slab, offset);
            if (next.casts) slab = next;
            else if (next.step && casters.bottom >= next.plane && casters.bottom <= next.high)
                slab = Slab(next.high, casters.bottom, true, true, false, false, next.plane);
        }
        if (slab.casts && is_within(slab, height)) return true;
        if (lowest && !slab.casts) return false;
        lowest = lowest || !slab.casts;
        float meets = clamp(height, slab.low, slab.high);
        float next = slab.casts ? meets : casters.bottom;
        // A sheet along the light rises by much from texel to texel: where it meets the line, two looks
        // at it tell.
        float off = slab.casts ? meets - height : 0.0;
        float bend = off_before - off;
        bool aims = !SOLID && off * off_before != 0.0 && abs(bend) > 1e-3 * abs(off);
        float aim = height + off * (height - before) / (aims ? bend : 1.0);
        if (aims && aim > 0.0 && aim < casters.top) next = aim;
        before = height;
        off_before = off;
        height = next;
    }
    return false;
}
