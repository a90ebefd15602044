// A search through the Sun's disc: which of its directions casters block (surface/shadow.glsl).
//
// First all directions are tried at one height, near that of the highest casters: one look settles those
// that meet them, and all where nothing else stands around. The lines of the others are followed down.

#include "surface/shadow.glsl"

// Besides the directions that stand for the disc, so many near its middle look for casters.
const int NEAR_TAPS = 6;
// Directions that a sample tries at most.
const int TAPS_OF_SAMPLE = 20;
// Between successive directions [rad].
const float GOLDEN_ANGLE = 2.39996323;

// The samples of a group, all on the plane of the group's own receiver.
struct Samples {
    Receiver of_group;
    mat2x3 steps;   // of the place from one texel of the raster to the next
    vec3 corner;    // of the place at the first texel of the cell's window
    uint group;
    int count;
};

// Each sample of a group in turn, again and again.
Receiver next_receiver(Samples samples, inout uint left) {
    left = left == 0u ? samples.group : left;
    Receiver r = samples.of_group;
    r.here = samples.corner + samples.steps * vec2(next_texel(left));
    return r;
}

// Those of a group's samples that no plane shades to which the Sun is a point.
//
// reach : texels per metre of height to the disc's edge
uint past_planes(sampler2D depths, sampler2D slopes, SunMap map, Samples samples, float reach) {
    uint left = samples.group, past = 0u;
    do {
        uint bit = lowest_of(left);
        Receiver r = next_receiver(samples, left);
        bool lit = lit_past_planes(depths, slopes, map, r, vec2(0.0), 0.5 / reach) > 0.5;
        past |= lit ? bit : 0u;
    } while (left != 0u);
    return past;
}

// Mean over the samples of a group of the light that low steps leave.
float mean_past_steps(sampler2D depths, sampler2D behind, SunMap map, Samples samples) {
    vec2 offset = to_surface(map, samples.of_group);
    uint left = samples.group;
    float lit = 0.0;
    do lit += lit_past_steps(depths, behind, map, next_receiver(samples, left), offset); while (left != 0u);
    return lit / float(samples.count);
}

// Directions that fill the Sun's disc together, one after the other from a group's samples, on a spiral.
struct Spiral {
    vec2 first;     // unit vector
    float before;   // squared radius of the first one, as a part of the disc's
    float share;    // from one to the next
    int taps;
};

const mat2 ON_SPIRAL = mat2(cos(GOLDEN_ANGLE), sin(GOLDEN_ANGLE), -sin(GOLDEN_ANGLE), cos(GOLDEN_ANGLE));

// Radius of a direction, as a part of the disc's.
float radius_of(Spiral spiral, int number) {
    return sqrt(float(number) * spiral.share + spiral.before);
}

// A bit for each direction lies in four words: the place of a word's bits there.
uvec4 in_word(uint bits, int word) {
    return bits * uvec4(equal(ivec4(word), ivec4(0, 1, 2, 3)));
}

// What the directions meet at one height.
struct Tried {
    float high;        // that height over the receivers [m]
    float top;         // highest of the slabs [m]
    float lower_top;   // highest of the slabs that are lower [m]
    float bottom;      // lowest of the slabs' ends over the receivers [m]
    float foot;        // lowest place of the receivers' own surface where a slab reaches it [m]
    float lowest;      // of the slabs' upper ends [m]
    bool tall;         // there are slabs as high as that
    bool steps;        // there are low steps
    uvec4 blocked;     // a bit for each direction: it meets one of the first
    uvec4 lower;       // or it comes over a lower one
};

// A slab past which a direction comes.
void add_slab(inout Tried tried, Slab slab) {
    tried.steps = tried.steps || slab.step;
    if (slab.casts) {
        tried.top = slab.high > tried.top ? slab.high : tried.top;
        tried.lowest = slab.high < tried.lowest ? slab.high : tried.lowest;
        // Compared: min takes llvmpipe longer.
        if (slab.ends) tried.bottom = slab.low < tried.bottom ? slab.low : tried.bottom;
        else tried.foot = slab.low < tried.foot ? slab.low : tried.foot;
    }
}

// Looks for casters on rings towards the disc's middle: the lower they are, the nearer they have to be to
// matter. All directions are tried where the highest of them end, else where the bound for all casters does.
Tried tried_on_rings(sampler2D depths, SunMap map, Samples samples, Slab overhead, Spiral spiral,
                     float highest, float reach, float turn) {
    Tried tried = Tried(highest, 0.0, 0.0, highest, highest, highest, false, false, uvec4(0u), uvec4(0u));
    float spread = spread_at(highest, reach), near = 1.0 - 0.4 * turn;
    vec2 lean = highest * map.lean, direction = -spiral.first;
    uint left = samples.group;
    int rings = 0;
    do {
        near *= 0.55;
        Receiver r = next_receiver(samples, left);
        Slab slab = slab_near(depths, map, r, overhead, near * (spread * direction + lean));
        direction = ON_SPIRAL * direction;
        add_slab(tried, slab);
        if (slab.casts) {
            bool lower = slab.high < (1.0 - MISS) * (1.0 - MISS) * highest;
            tried.lower_top = lower && slab.high > tried.lower_top ? slab.high : tried.lower_top;
        }
    } while (++rings < NEAR_TAPS);
    tried.tall = tried.top >= (1.0 - MISS) * highest;
    if (tried.tall) tried.high = min(tried.top, highest);
    else tried.lower_top = tried.top;
    return tried;
}

// Tries all directions at one height.
void try_all(sampler2D depths, SunMap map, Samples samples, Slab overhead, Spiral spiral, float reach,
             inout Tried tried) {
    float high = tried.high, met = (1.0 - MISS) * high, spread = spread_at(high, reach);
    vec2 lean = high * map.lean, direction = spiral.first;
    uint left = samples.group;
    int k = 0, word = 0;
    do {
        uint blocked = 0u, lower = 0u;
        do {
            Receiver r = next_receiver(samples, left);
            vec2 offset = radius_of(spiral, k) * spread * direction + lean;
            Slab slab = slab_near(depths, map, r, overhead, offset);
            direction = ON_SPIRAL * direction;
            add_slab(tried, slab);
            uint bit = slab.casts ? 1u << uint(k & 31) : 0u;
            bool tall = slab.high >= met, higher = slab.high > tried.lower_top;
            blocked |= tall ? bit : 0u;
            lower |= tall ? 0u : bit;
            tried.lower_top = slab.casts && !tall && higher ? slab.high : tried.lower_top;
            ++k;
        } while (k < spiral.taps && (k & 31) != 0);
        tried.blocked |= in_word(blocked, word);
        tried.lower |= in_word(lower, word);
        ++word;
    } while (k < spiral.taps);
    tried.tall = tried.tall || tried.blocked != uvec4(0u);
}

// The first look of some lines at the casters, which settles most. Returns those that meet a slab there.
//
// wanted, lower : a bit for each direction; which of them come over a slab that is lower than tried first
// unsettled : those that have to be followed
uvec4 blocked_at_first(sampler2D depths, SunMap map, Samples samples, Slab overhead, Spiral spiral,
                       float reach, Casters casters, uvec4 wanted, uvec4 lower, out uvec4 unsettled) {
    uvec4 blocked = uvec4(0u);
    unsettled = uvec4(0u);
    if (wanted == uvec4(0u)) return blocked;
    float low = casters.bottom, high = casters.lower_top;
    float low_spread = spread_at(low, reach), high_spread = spread_at(high, reach);
    vec2 direction = spiral.first;
    uint left = samples.group;
    int k = 0, word = 0;
    do {
        uint over_lower = casters.tall ? lower.x : ~0u, met = 0u, more = 0u, bit = 1u;
        lower = lower.yzww;
        do {
            bool past_tall = (over_lower & bit) == 0u;
            float height = past_tall ? low : high, spread = past_tall ? low_spread : high_spread;
            vec2 offset = radius_of(spiral, k) * spread * direction + height * map.lean;
            direction = ON_SPIRAL * direction;
            Slab slab = slab_near(depths, map, next_receiver(samples, left), overhead, offset);
            bool meets = slab.casts && is_within(slab, height);
            met |= meets ? bit : 0u;
            more |= meets || past_tall && !slab.casts ? 0u : bit;
            bit <<= 1u;
        } while (++k < spiral.taps && bit != 0u);
        blocked |= in_word(met, word);
        unsettled |= in_word(more, word);
        ++word;
    } while (k < spiral.taps);
    unsettled &= wanted;
    return blocked & wanted;
}

// Follows some lines past the casters, one by one. Returns those that meet one.
uvec4 blocked_lines(sampler2D depths, sampler2D behind, SunMap map, Samples samples, Slab overhead,
                    Spiral spiral, float reach, Casters casters, uvec4 wanted, uvec4 lower) {
    uvec4 blocked = uvec4(0u);
    if (wanted == uvec4(0u)) return blocked;
    do {
        int word = wanted.x != 0u ? 0 : wanted.y != 0u ? 1 : wanted.z != 0u ? 2 : 3;
        uvec4 one = in_word(~0u, word) & wanted;
        uint bit = lowest_of(one.x | one.y | one.z | one.w);
        one = in_word(bit, word);
        wanted &= ~one;
        int k = clamp(32 * word + (floatBitsToInt(float(bit)) >> 23) - 127, 0, spiral.taps - 1);
        float angle = GOLDEN_ANGLE * float(k);
        vec2 direction = mat2(spiral.first, -spiral.first.y, spiral.first.x) * vec2(cos(angle), sin(angle));
        uint left = samples.group;
        int past = k % samples.count;
        while (past-- > 0) left ^= lowest_of(left);
        Receiver r = next_receiver(samples, left);
        bool past_tall = casters.tall && (lower & one) == uvec4(0u);
        vec2 ray = radius_of(spiral, k) * reach * direction;
        bool met = met_by_line(depths, behind, map, r, overhead, ray, reach, casters, past_tall);
        blocked |= met ? one : uvec4(0u);
    } while (wanted != uvec4(0u));
    return blocked;
}

// Share of the disc's light in the directions that are not blocked, per band.
//
// limb_u, limb_v : darkening of the disc towards its limb, per band
vec4 unblocked_light(SunMap map, Receiver r, Spiral spiral, float reach, uvec4 blocked, vec4 limb_u,
                     vec4 limb_v) {
    // Sums of 1, fall and fall^2, where 1 - fall is the cosine of emergence from the Sun's surface.
    vec3 lit = vec3(0.0), all = vec3(0.0);
    vec2 direction = spiral.first;
    int k = 0;
    do {
        uint dark = blocked.x, bit = 1u;
        blocked = blocked.yzww;
        do {
            float radius = radius_of(spiral, k), fall = 1.0 - sqrt(1.0 - radius * radius);
            vec2 ray = radius * reach * direction;   // texels per metre of height
            direction = ON_SPIRAL * direction;
            // Below the surface's own horizon: the disc's cosine leaves it out.
            vec3 light = dot(r.slope, map.lean + ray) < 1.0 ? vec3(1.0, fall, fall * fall) : vec3(0.0);
            all += light;
            lit += (dark & bit) != 0u ? vec3(0.0) : light;
            bit <<= 1u;
        } while (++k < spiral.taps && bit != 0u);
    } while (k < spiral.taps);
    // The law of limb_profile (physics/solar_disc.py), summed.
    return (lit.x - limb_u * lit.y - limb_v * lit.z)
         / max(all.x - limb_u * all.y - limb_v * all.z, 1e-6);
}

// Share of the disc's light that passes the casters around a group of samples, per band: their mean.
// Each sample takes its share of the directions that fill the disc together.
//
// highest : that a caster may stand over them [m]
// reach : texels per metre of height to the disc's edge
// limb_u, limb_v : darkening of the disc towards its limb, per band
// turn : two numbers 0..1 that vary from group to group
// lowest : how high over them the lowest end of what was seen to cast stands, 0 where steps do [m]
vec4 disc_past(sampler2D depths, sampler2D behind, SunMap map, Samples samples, float highest, float reach,
               vec4 limb_u, vec4 limb_v, vec2 turn, out float lowest) {
    float angle = 6.28318531 * turn.x;
    int taps = samples.count * clamp(map.taps / samples.count, 1, TAPS_OF_SAMPLE);
    float share = 1.0 / float(taps);
    Spiral spiral = Spiral(vec2(cos(angle), sin(angle)), turn.y * share, share, taps);
    bool sheets = !SOLID;
    Slab overhead = NO_SLAB;
    if (sheets) overhead = overhead_slab(depths, map, samples.of_group);
    Tried tried = tried_on_rings(depths, map, samples, overhead, spiral, highest, reach, turn.y);
    try_all(depths, map, samples, overhead, spiral, reach, tried);
    float past_steps = 1.0;
    // llvmpipe looks for steps also where there are none: then all at one place, which costs least.
    Samples stepped = samples;
    if (!tried.steps) stepped.corner = vec3(0.0);
    if (tried.steps) past_steps = mean_past_steps(depths, behind, map, stepped);
    lowest = tried.steps ? 0.0 : min(tried.lowest, tried.bottom);
    if (tried.top <= 0.0) return vec4(past_steps);
    float deepest = min(tried.bottom, tried.foot);
    // Where no slab ends above the receivers, they all run down to them.
    float bottom = tried.bottom < highest ? tried.bottom : max(deepest, 0.05 * tried.top);
    Casters casters = Casters(tried.top, bottom, tried.lower_top, tried.tall);
    // Nothing is left to try where all that stands around is as high as tried.
    bool settled = deepest >= (1.0 - MISS) * tried.high;
    uvec4 all = ~0u * uvec4(greaterThan(ivec4(taps), ivec4(0, 32, 64, 96)));
    uvec4 open = settled ? uvec4(0u) : all & ~tried.blocked, unsettled;
    uvec4 blocked = tried.blocked | blocked_at_first(depths, map, samples, overhead, spiral, reach, casters,
                                                     open, tried.lower, unsettled);
    blocked |= blocked_lines(depths, behind, map, samples, overhead, spiral, reach, casters, unsettled,
                             tried.lower);
    return past_steps * unblocked_light(map, samples.of_group, spiral, reach, blocked, limb_u, limb_v);
}
