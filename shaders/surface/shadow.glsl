// The Sun's disc past the casters of a shadow map.
//
// A map holds, for each texel of a square across the light, where the light first meets a surface
// (its rows 0..size) and where it first leaves a solid again (rows size..2 size): the casters as
// slabs. A second texture holds where it would meet the next surface behind. From a receiver,
// directions within the Sun's disc are straight lines over the map, so many texels for each metre of
// height; a direction is blocked where its line runs through a slab. The edge that a shadow gets from
// the caster's lower end and the one from its upper end both come out.
//
// The map is drawn along a direction near the Sun's, so that it serves many frames: the lines to the
// Sun lean against it.

#include "surface/caster_bounds.glsl"
#include "surface/creases.glsl"
#include "surface/slabs.glsl"

// Bounds on the casters' depths: those of caster_level, and for cells of 64 texels in the cone to the
// Sun's disc.
const int CONE = CASTER_LEVELS;

// Nearest and farthest depth within a level's reach of a place, or in the cone over it.
vec2 depths_around(sampler2D tops, SunMap map, vec2 place, int level) {
    int shift = level < CONE ? 3 : 6;
    ivec2 at = clamp(ivec2(place) >> shift, ivec2(0), ivec2((map.size >> shift) - 1));
    at.x += map.bounds + level * (map.size >> 3);
    return read_texel(tops, at).rg;
}

// What the bounds tell of the casters around a receiver.
struct Around {
    float high;    // none that matters stands higher over the receiver [m]
    bool dark;     // all of the Sun is behind them
    bool near;     // the Sun is a point to them
    bool search;   // neither, nor is all of it free
};

// Whether no caster stands over a receiver, nor over those on the same plane, in the texels up to
// `reach` away: none stands over the plane that the map's cell holds (shadow/planes.frag).
bool free_of_casters(sampler2D planes, SunMap map, Receiver r, float reach) {
    ivec2 cell = clamp(ivec2(r.here.xy) >> 3, ivec2(0), ivec2((map.size >> 3) - 1));
    vec3 over = read_texel(planes, cell + ivec2(map.column >> 3, 0)).xyz;
    vec2 place = r.here.xy - 8.0 * (vec2(cell) + 0.5);
    vec2 slope = abs(map.depth * over.xy + r.slope);
    float high = map.top - r.here.z - map.depth * (over.z + dot(over.xy, place)) + r.drop;
    return reach <= 8.0 && high + reach * (slope.x + slope.y) <= r.slack;
}

// reach : texels per metre of height to the disc's edge
// spread : it shall hold for receivers on the same plane up to so many texels away, too
Around casters_around(sampler2D tops, SunMap map, Receiver r, float reach, float spread) {
    // Around the middle of the line to the Sun lies all of the line, and of those to the disc.
    float half_lean = 0.5 * length(map.lean);
    // How high the casters reach that can matter: higher ones are farther off on the map.
    // Receivers aside stand at other heights; the bounds are for the lowest, their planes the same.
    float lower = spread * (abs(r.slope.x) + abs(r.slope.y));
    float above = map.top - r.here.z + lower, high = above, low = 0.0;
    float slack = r.slack + 2.0 * spread * r.tilt;
    float radius = 0.0;
    float less = high * (reach + half_lean) + 1.0 + spread;
    int level, finer = caster_level(less), turn = 0;
    do {
        level = finer;
        radius = less;
        // The cone's bounds hold for the receiver's own place.
        vec2 place = r.here.xy + (level < CONE ? 0.5 * high : 0.0) * map.lean;
        vec2 bounds = depths_around(tops, map, place, level);
        high = min(high, above - map.depth * bounds.x);
        low = above - 2.0 * lower - map.depth * bounds.y;
        less = high * (reach + half_lean) + 1.0 + spread;
        finer = caster_level(less);
    } while (++turn < 4 && finer < level && high > slack);
    // Where casters of much the same height stand over all of the neighbourhood, all is dark. They
    // stand over the receiver's own plane where they are higher than it is anywhere there.
    float window = 1.5 * radius + 16.0 + half_lean * above;
    float plane = (abs(r.slope.x) + abs(r.slope.y)) * window + r.slack + 2.0 * window * r.tilt;
    bool dark = level < CONE && low > plane && (high - low) * (reach + 2.0 * half_lean) < 4.0;
    // The disc spans less than a texel, and the line to it leans by not much more: only the texels
    // smooth the edge.
    bool near = !dark && high > slack && high * max(reach, 1.4 * half_lean) < 1.0;
    return Around(high, dark, near, !dark && !near && high > slack);
}

// The first of the four texels whose middles are nearest to an offset [texels] from the receiver.
ivec2 nearest_texels(SunMap map, Receiver r, vec2 offset) {
    return clamp(ivec2(floor(r.here.xy + offset - 0.5)), ivec2(0), ivec2(map.size - 2));
}

// Heights over the receiver [m] of four texels of the texture, from one of them on.
vec4 heights_of(sampler2D depths, SunMap map, Receiver r, ivec2 at) {
    vec4 depth = vec4(read_texel(depths, at).r, read_texel(depths, at + ivec2(1, 0)).r,
                      read_texel(depths, at + ivec2(0, 1)).r,
                      read_texel(depths, at + ivec2(1, 1)).r);
    return map.top - r.here.z - map.depth * depth;
}

// Heights [m] of a receiver's own surface at four texels.
vec4 plane_at(Receiver r, ivec2 first) {
    vec2 offset = vec2(first) + 0.5 - r.here.xy;
    return vec4(receiver_plane(r, offset), receiver_plane(r, offset + vec2(1.0, 0.0)),
                receiver_plane(r, offset + vec2(0.0, 1.0)), receiver_plane(r, offset + 1.0));
}

// Heights over the receiver [m] at four texels, those of its own surface there, and which texels cast
// a shadow.
vec4 heights_at(sampler2D depths, SunMap map, Receiver r, ivec2 first, out vec4 plane,
                out bvec4 casting) {
    plane = plane_at(r, first);
    vec4 high = heights_of(depths, map, r, first + ivec2(map.column, 0));
    // A little above the receiver's own surface.
    casting = greaterThan(high, plane + r.slack);
    return high;
}

// How far a line to the Sun leans on its way past casters so near that the Sun is a point [texels]:
// by less than one; how far, the casters' own height tells.
//
// highest : that a caster may stand [m]
vec2 lean_past(sampler2D depths, SunMap map, Receiver r, float highest) {
    bvec4 at_foot, at_top;
    vec4 plane;
    vec2 offset = 0.5 * highest * map.lean;
    bool leans = length(offset) > 0.05;
    if (leans) {
        vec4 foot = heights_at(depths, map, r, nearest_texels(map, r, vec2(0.0)), plane, at_foot);
        vec4 top = heights_at(depths, map, r, nearest_texels(map, r, 2.0 * offset), plane, at_top);
        vec4 high = max(mix(vec4(0.0), foot, at_foot), mix(vec4(0.0), top, at_top));
        offset = max(max(high.x, high.y), max(high.z, high.w)) * map.lean;
    }
    return offset;
}

// From a receiver to the place on its surface that it stands over, down the slope from there [texels].
// A receiver on a sheet counts where it stands, on the sheet's sunny side.
vec2 to_surface(SunMap map, Receiver r) {
    vec2 gradient = r.slope / map.texel;
    return SOLID ? LIFT * gradient * inversesqrt(1.0 + dot(gradient, gradient)) : vec2(0.0);
}

// Mean of what four texels say, where one of them weighs so much along rows and columns.
float mean_of(vec4 texels, vec2 weight) {
    return mix(mix(texels.x, texels.y, weight.x), mix(texels.z, texels.w, weight.x), weight.y);
}

// Lit share of a receiver beside a low step that stands on its surface, of what its four texels say.
//
// lit : that share; edge : towards the step, across its edge
// rise : of the step's top over the receiver's surface, along the light [m]
//
// Texels tell of their middles, so any step seems to shade what lies within a texel of it, its sunny
// side too. But a step stands upright on the receiver's own surface: its top overhangs its foot, as
// the light sees it, by so much, and that is all that it shades. On the sunny side this is negative.
// The top's edge may lie anywhere between the middles that cast and those that do not; the foot,
// which hides what is behind, lies beyond the receiver.
float lit_near_step(SunMap map, Receiver r, float lit, vec2 edge, float rise) {
    vec2 gradient = r.slope / map.texel;
    float along = dot(gradient, edge) / max(length(edge), 1e-6);
    float overhang_texels = (rise + r.lift) / map.texel * along / (1.0 + dot(gradient, gradient));
    float shaded = clamp(overhang_texels, 0.0, 1.0 - lit);
    return lit / (lit + shaded);
}

// Across the edge between dark texels and lit ones, towards the dark, where one of the four weighs so
// much along rows and columns.
vec2 edge_of(vec4 dark, vec2 weight) {
    return vec2(mix(dark.y - dark.x, dark.w - dark.z, weight.y),
                mix(dark.z - dark.x, dark.w - dark.y, weight.x));
}

// Lit share of four texels that weigh so much along rows and columns, of those that tell of the receiver.
float lit_of_planes(Planes planes, Receiver r, vec2 weight) {
    vec4 lit = vec4(planes.same_surface) * this_side(planes, r);
    float all = mean_of(max(lit, vec4(planes.shading)), weight);
    return all > 0.0 ? mean_of(lit, weight) / all : 1.0;
}

// Lit share of the four texels nearest to an offset [texels] from a receiver, by their planes.
//
// highest : no plane higher over the receiver shades it [m]
float lit_past_planes(sampler2D depths, sampler2D slopes, SunMap map, Receiver r, vec2 offset,
                      float highest) {
    vec2 place = r.here.xy + r.foot.xy + offset;
    ivec2 first = clamp(ivec2(floor(place - 0.5)), ivec2(0), ivec2(map.size - 2));
    Planes planes = planes_at(depths, slopes, map, r, first, highest);
    return lit_of_planes(planes, r, clamp(place - vec2(first) - 0.5, 0.0, 1.0));
}

// Which of four texels that do not cast show a flat caster near its crease with the receiver's own surface,
// or lie past that crease, where the caster passes over the receiver: those tell nothing of it. A wall may
// be thinner than a texel, and what lies past it is lit.
//
// high : heights of the four over the receiver [m]; edge : towards the dark
bvec4 past_crease(sampler2D depths, SunMap map, Receiver r, ivec2 first, vec4 high, vec2 edge) {
    vec2 corner = vec2(greaterThanEqual(edge, vec2(0.0))), inward = 2.0 * corner - 1.0;
    ivec2 at = first + ivec2(corner) + ivec2(map.column, 0), x = ivec2(inward.x, 0), y = ivec2(0, inward.y);
    // Rises over the receiver's own surface: at the darkest corner, one and two texels further into the
    // dark along rows and columns.
    float above = map.top - r.here.z;
    float level = dot(r.slope, vec2(first) + corner + 0.5 - r.here.xy) - r.drop - r.lift;
    float here = mix(mix(high.x, high.y, corner.x), mix(high.z, high.w, corner.x), corner.y) - level;
    vec4 deep = vec4(read_texel(depths, at + x).r, read_texel(depths, at + y).r,
                     read_texel(depths, at + 2 * x).r, read_texel(depths, at + 2 * y).r);
    vec2 along = r.slope * inward;
    vec4 rise = above - map.depth * deep - level - vec4(along, 2.0 * along);
    vec2 bend = abs(rise.zw - 2.0 * rise.xy + here);
    // That of a flat caster changes by so much to the next texel.
    vec2 slope = 0.5 * (rise.zw - here) * inward;
    vec2 receiver = r.here.xy + r.foot.xy - vec2(first) - 0.5;
    bool shades = max(bend.x, bend.y) < r.slack && here + dot(slope, receiver - corner) > r.exact;
    vec4 of_caster = here - dot(slope, corner) + vec4(0.0, slope.x, slope.y, slope.x + slope.y);
    return bvec4(uvec4(shades) & uvec4(lessThan(of_caster, vec4(r.lift + 4.0 * r.slack))));
}

// Lit share of the four texels nearest to an offset [texels] from a receiver, past solids.
float lit_by_neighbours(sampler2D depths, SunMap map, Receiver r, vec2 offset) {
    ivec2 first = nearest_texels(map, r, offset);
    vec4 plane;
    bvec4 casting;
    vec4 high = heights_at(depths, map, r, first, plane, casting);
    vec4 dark = vec4(casting);
    vec4 lit = 1.0 - dark;
    vec2 weight = clamp(r.here.xy + offset - vec2(first) - 0.5, 0.0, 1.0);
    float share = mean_of(lit, weight), shaded = mean_of(dark, weight);
    if (shaded > 0.0 && share > 0.0) {
        vec2 edge = edge_of(dark, weight);
        vec4 past = vec4(past_crease(depths, map, r, first, high, edge));
        float telling = mean_of(lit * (1.0 - past), weight);
        if (telling < share) return telling / (telling + shaded);
        float rise = mean_of(dark * (high - plane), weight) / shaded;
        // Of the casters, those that end below the receiver stand on its surface.
        vec4 low = heights_of(depths, map, r, first + ivec2(map.column, map.size));
        float standing = mean_of(dark * vec4(lessThan(low, plane)), weight) / shaded;
        // High casters may stand anywhere.
        float low_step = 1.0 - smoothstep(LOW_STEP, HIGH_STEP, rise / texel_height(r));
        share = mix(share, lit_near_step(map, r, share, edge, rise), standing * low_step);
    }
    return share;
}

// Lit share of a receiver past the low steps on its surface alone.
//
// offset : from the receiver to its place on the surface [texels]
float lit_past_steps(sampler2D depths, sampler2D behind, SunMap map, Receiver r, vec2 offset) {
    ivec2 first = nearest_texels(map, r, offset);
    vec4 plane = plane_at(r, first);
    mat2x4 depth = transpose(mat4x2(depths_at(depths, map, first),
                                    depths_at(depths, map, first + ivec2(1, 0)),
                                    depths_at(depths, map, first + ivec2(0, 1)),
                                    depths_at(depths, map, first + 1)));
    float above = map.top - r.here.z;
    vec4 high = above - map.depth * depth[0], low = above - map.depth * depth[1];
    vec4 rises = high - plane;
    bvec4 casting = greaterThan(high, plane + r.slack);
    vec4 over = vec4(casting) * vec4(greaterThanEqual(low, plane));
    // A step below what floats there.
    vec4 next = vec4(depth_behind(behind, map, first), depth_behind(behind, map, first + ivec2(1, 0)),
                     depth_behind(behind, map, first + ivec2(0, 1)), depth_behind(behind, map, first + 1));
    if (dot(over, over) > 0.0) rises = mix(rises, above - map.depth * next - plane, over);
    vec4 dark = vec4(casting) * vec4(greaterThan(rises, vec4(r.slack)))
              * vec4(lessThan(rises, vec4(r.step)));
    vec2 weight = clamp(r.here.xy + offset - vec2(first) - 0.5, 0.0, 1.0);
    float shaded = mean_of(dark, weight);
    float lit = 1.0 - shaded;
    if (shaded > 0.0 && lit > 0.0) {
        float rise = mean_of(dark * rises, weight) / shaded;
        lit = lit_near_step(map, r, lit, edge_of(dark, weight), rise);
    }
    return lit;
}
