#include "block/lamps"
#include "common/sun.glsl"
#include "surface/caster_bounds.glsl"
#include "surface/material.glsl"

// In red 1 / z of the nearest caster [m-1], 0 where there is none, and in green where light first leaves
// a solid again. In blue and alpha the change of red from one column and one row to the next.
uniform sampler2D lamp_maps;
// In green, bounds on it.
uniform sampler2D lamp_bounds;

// Lines that stand for the aperture, three times as many where it blurs over more than so many texels: there
// casters of several texels may be small beside it.
const int LAMP_LINES = 32;
const float WIDE_BLUR = 8.0;
// A line looks at each texel, and past so many of them as often as it has grown by one part of so many.
const float LOOKS = 32.0;
// So far [texels] the bounds tell (surface/caster_bounds.glsl), and which of them a line asks first.
const float LEAPS[CASTER_LEVELS] = float[](8.0, 16.0, 24.0, 32.0, 48.0, 64.0, 96.0, 128.0, 192.0, 256.0);
const int FIRST_LEAP = 3;
// Lines that go no farther [texels] are most often free, which the texels around tell at once.
const float NEAR_LINES = 5.0;
// Cosine and sine of the golden angle, 2.39996323 rad, between successive directions.
const mat2 GOLDEN_TURN = mat2(-0.73736888, 0.67549029, -0.67549029, -0.73736888);
// A receiver stands so far over its triangle [texels].
const float LIFT = 0.25;
// So far towards the viewer lies what is certainly on the viewer's side of all that meets the receiver's
// surface there [texels]: rounding moves a place by less.
const float SEEN = 0.05;
// So close to a crease a texel's middle may show either side: rasterisers round corners to 1/256 [texels].
const float SNAP = 0.01;

// Of a lamp in the block.
const int LAMP_ROWS = 10;

// A spot light, camera axes.
struct Lamp {
    vec3 place;         // [m]
    float radius;       // of the aperture [m]
    vec3 axis;          // unit, of the beam
    float half_angle;   // of the cone of full intensity [rad]
    vec4 intensity;     // [W sr-1]
    vec4 column;        // at v from the lamp, the map's texel is dot(v, xyz) / dot(v, axis) + w
    vec4 row;
    float edge;         // of the smooth fall around the cone [rad]
    int first;          // column of the lamp's map
    int first_bounds;   // and of the bounds on it
    float hard_near;    // casters nearer than this 1 / z cast hard shadows, as do all where it is 0 [m-1]
    bool solid;         // all casters are closed
};

Lamp lamp_at(int index) {
    int i = LAMP_ROWS * index;
    vec4 place = lamp_rows[i], axis = lamp_rows[i + 1], last = lamp_rows[i + 5];
    return Lamp(place.xyz, place.w, axis.xyz, axis.w, lamp_rows[i + 2], lamp_rows[i + 3],
                lamp_rows[i + 4], last.x, int(last.y), int(last.z),
                abs(last.w), last.w < 0.0);
}

// The same, where it stands and shines when the row of a surface is exposed. Its map stays that of time 0.
Lamp lamp_then(Lamp lamp, int index, float time) {
#ifdef MOVING
    int i = LAMP_ROWS * index + 6;
    lamp.place += time * (lamp_rows[i].xyz + time * lamp_rows[i + 1].xyz);
    lamp.axis = normalize(lamp.axis + time * (lamp_rows[i + 2].xyz + time * lamp_rows[i + 3].xyz));
#endif
    return lamp;
}

// A surface where and as it stands when the maps of lamps are drawn, at time 0.
Surface when_mapped(Surface s) {
#ifdef MOVING
    // Elsewhere, its own spacecraft would stand before it or behind it on the maps.
    mat3 to_middle = mat3(camera_from_body) * transpose(mat3(pose_at(s.time)));
    s.place = (camera_from_body * vec4(s.body, 1.0)).xyz;
    s.facet = normalize(to_middle * s.facet);
    s.plain_n = normalize(to_middle * s.plain_n);
    s.wo = normalize(to_middle * s.wo);
#endif
    return s;
}

// Intensity at an angle [rad] from the beam's axis over that within the cone.
float beam_profile(Lamp lamp, float angle) {
    return 0.5 + 0.5 * cos(PI * clamp((angle - lamp.half_angle) / lamp.edge, 0.0, 1.0));
}

// Irradiance vector of an aperture of unit intensity [m-2], towards the light: integral of unit vectors over
// squared distances, which is also the attraction of a uniform disc.
//
// On the axis it is closed, 2 / (q (q + d)) with q^2 = d^2 + R^2. The terms for points beside it follow
// from the disc's multipoles 1 - x P2 / 4 + x^2 P4 / 8, x = R^2 / d^2, as fractions. They leave 1e-3 from three
// radii on, and 2e-2 at 1.5 radii.
//
// v : the surface from the lamp [m]
vec3 aperture_field(Lamp lamp, vec3 v) {
    float R2 = lamp.radius * lamp.radius, d = length(v), q = sqrt(d * d + R2);
    vec3 beam = v / d;
    float c = dot(beam, lamp.axis), sine2 = 1.0 - c * c, x = min(R2 / (d * d), 0.5);
    float along = 1.0 + 1.125 * sine2 * x / (1.0 + x * (2.03 - 2.43 * sine2));
    float across = 0.75 * c * x / (1.0 + x * (2.92 * c * c - 1.25));
    return 2.0 / (q * (q + d)) * (across * (c * beam - lamp.axis) - along * beam);
}

// A place that a lamp may light, on the lamp's map: a little over the triangle that it lies on.
struct LampReceiver {
    vec2 place;     // [texels], the middle of the first at 0
    float near;     // 1 / z [m-1]
    vec2 plane;     // of its own surface: change of 1 / z from texel to texel
    float slack;    // by so much rounding moves it
    vec3 foot;      // place and 1 / z on the triangle itself
    vec3 seen;      // and a little towards the viewer from there
    float exact;    // so far from its plane a map may show the triangle [m-1]
    float bent;     // what bends more from its plane is another surface [m-1]
    float lifted;   // so far over the triangle, and rounding, is the receiver [m-1]
    bool flat_facet;   // the triangle is the surface, and not a facet of a smooth one
};

// Place on a lamp's map [texels] and 1 / z [m-1] at v from the lamp [m].
vec3 on_map(Lamp lamp, vec3 v) {
    float near = 1.0 / dot(v, lamp.axis);
    vec2 place = vec2(dot(lamp.column.xyz, v), dot(lamp.row.xyz, v)) * near;
    return vec3(place + vec2(lamp.column.w, lamp.row.w) - 0.5, near);
}

// v : the surface from the lamp [m]
//
// With v = z (X, Y, 1) in lamp axes, the plane n.v = h has 1 / z = n.(X, Y, 1) / h: linear over the
// map.
LampReceiver lamp_receiver(Surface s, Lamp lamp, vec3 v) {
    vec3 n = dot(s.facet, v) < 0.0 ? s.facet : s.plain_n;
    vec2 per_tangent2 = vec2(dot(lamp.column.xyz, lamp.column.xyz),
                             dot(lamp.row.xyz, lamp.row.xyz));
    float texel = inversesqrt(min(per_tangent2.x, per_tangent2.y));   // as a tangent
    float texel_m = texel * dot(v, lamp.axis);
    LampReceiver r;
    r.foot = on_map(lamp, v);
    r.seen = on_map(lamp, v + SEEN * texel_m * s.wo);
    // The smooth surface that the normals stand for lies above its facets by the sagitta of an edge;
    // a quarter of a texel lifts the receiver there.
    v += LIFT * texel_m * s.plain_n;
    vec3 over = on_map(lamp, v);
    r.place = over.xy;
    r.near = over.z;
    r.plane = vec2(dot(n, lamp.column.xyz), dot(n, lamp.row.xyz)) / per_tangent2
            / min(dot(n, v), -1e-9);
    // Rounding: positions in camera axes are good to 1e-7 of their size. The plane's normal, from
    // differences of neighbouring positions, is good to about 1e-3 rad, which at incidence t tilts
    // the plane by 1e-3 / cos^2 t over up to 3 texels.
    float slope2 = dot(r.plane, r.plane) / (r.near * r.near * texel * texel);
    r.slack = r.near * (4e-6 + 4e-7 * length(s.place) * r.near + 0.004 * texel * (1.0 + slope2));
    r.exact = r.near * (1e-6 + 2e-4 * texel * sqrt(slope2));
    // Facets that turn by less than half a degree are one surface.
    r.bent = 0.01 * r.near * texel * (1.0 + slope2);
    r.flat_facet = dot(n, s.plain_n) > 1.0 - 1e-6;
    r.lifted = r.near + dot(r.plane, r.foot.xy - r.place) - r.foot.z + r.slack;
    return r;
}

// Weights of three texels around a place, at an offset -0.5..0.5 from the middle one: a quadratic B-spline.
vec3 spline_weights(float offset) {
    float low = 0.5 * (0.5 - offset) * (0.5 - offset), high = 0.5 * (0.5 + offset) * (0.5 + offset);
    return vec3(low, 1.0 - low - high, high);
}

// Share of 3 x 3 texels that a lamp of no size reaches, of those that tell of the receiver.
//
// A texel tells of its middle. Beside a crease that may lie on the other side. The plane of what it shows,
// continued to the receiver, tells: a surface shades only where its plane passes over the receiver; and
// what lies past that plane on the receiver's own is past the crease.
//
// middle : of the texels
// nearer : only casters nearer than this [m-1] cast, besides those that meet the receiver's surface there
float lit_past_creases(Lamp lamp, LampReceiver r, ivec2 middle, float nearer) {
    vec2 offset = clamp(r.place - vec2(middle), -0.5, 0.5);
    vec3 wx = spline_weights(offset.x), wy = spline_weights(offset.y);
    float min_over = r.flat_facet ? r.exact : r.lifted;
    vec3 columns = vec3(-1.0, 0.0, 1.0) + float(middle.x) - r.foot.x;
    vec3 rows = vec3(-1.0, 0.0, 1.0) + float(middle.y) - r.foot.y;
    vec2 to_seen = r.foot.xy - r.seen.xy;
    mat3 lit = mat3(wx * wy.x, wx * wy.y, wx * wy.z);
    float shaded = 0.0;
    // Of texels not on the receiver's side of what shades it, negative.
    vec3 low = vec3(1.0), here = vec3(1.0), high = vec3(1.0);
    for (int j = 0; j < 3; ++j) {
        ivec2 at = middle + ivec2(lamp.first, j - 1);
        vec4 left = read_texel(lamp_maps, at - ivec2(1, 0)), centre = read_texel(lamp_maps, at),
             right = read_texel(lamp_maps, at + ivec2(1, 0));
        vec3 caster = vec3(left.r, centre.r, right.r);
        vec3 rise = caster - r.foot.z - r.plane.x * columns - r.plane.y * rows[j];
        if (all(lessThanEqual(rise, vec3(r.exact)))) continue;
        vec3 across = vec3(left.b, centre.b, right.b) - r.plane.x;
        vec3 along = vec3(left.a, centre.a, right.a) - r.plane.y;
        vec3 turn = abs(across) + abs(along);
        vec3 min_rise = mix(vec3(r.lifted), vec3(min_over), greaterThan(turn, vec3(r.bent)));
        vec3 casts = vec3(greaterThan(rise, min_rise));
        vec3 over_foot = rise - across * columns - along * rows[j];
        vec3 over = caster - r.seen.z - (across + r.plane.x) * (columns + to_seen.x)
                  - (along + r.plane.y) * (rows[j] + to_seen.y);
        vec3 judged = max(vec3(greaterThan(caster, vec3(nearer))), vec3(greaterThan(1.5 * turn, over_foot)));
        vec3 shading = casts * judged * vec3(greaterThan(over, vec3(min_over)));
        lit[j] *= 1.0 - casts;
        shaded += wy[j] * dot(wx, shading);
        vec3 margin = over_foot - r.exact - SNAP * turn;
        for (int i = 0; i < 3; ++i) {
            if (shading[i] == 0.0) continue;
            vec3 plane = margin[i] + across[i] * columns;
            low = min(low, plane + along[i] * rows.x);
            here = min(here, plane + along[i] * rows.y);
            high = min(high, plane + along[i] * rows.z);
        }
    }
    float free = dot(lit[0], step(0.0, low)) + dot(lit[1], step(0.0, here)) + dot(lit[2], step(0.0, high));
    return free + shaded > 0.0 ? free / (free + shaded) : 1.0;
}

// Share of a neighbourhood of the surface that a lamp of no size reaches: 3 x 3 texel tests, weighted
// by a quadratic B-spline. Each test compares with the receiver's own plane at that texel, so that a
// plane does not shadow itself at any incidence.
//
// nearer : only casters nearer than this [m-1] cast
float lit_by_point(Lamp lamp, LampReceiver r, float nearer) {
    ivec2 middle = clamp(ivec2(floor(r.place + 0.5)), ivec2(1), ivec2(lamp_map_size - 2));
    vec2 offset = clamp(r.place - vec2(middle), -0.5, 0.5);
    float expected = r.near + r.slack + dot(r.plane, vec2(middle) - r.place);
    vec3 wx = spline_weights(offset.x), wy = spline_weights(offset.y);
    float lit = 0.0;
    ivec2 casting = ivec2(0);
    for (int j = -1; j <= 1; ++j) {
        ivec2 at = middle + ivec2(lamp.first, j);
        vec3 caster = vec3(read_texel(lamp_maps, at - ivec2(1, 0)).r, read_texel(lamp_maps, at).r,
                           read_texel(lamp_maps, at + ivec2(1, 0)).r);
        vec3 here = expected + float(j) * r.plane.y + r.plane.x * vec3(-1.0, 0.0, 1.0);
        bvec3 free = lessThanEqual(caster, here);
        casting |= ivec2(!all(free), any(free));
        lit += wy[j + 1] * dot(wx, vec3(lessThanEqual(caster, max(here, vec3(nearer)))));
    }
    if (casting.x + casting.y == 2) lit = lit_past_creases(lamp, r, middle, nearer);
    return lit;
}

// Texels by which the edge of the aperture moves a caster's shadow for each 1 / z above the receiver.
vec2 aperture_reach(Lamp lamp) {
    return lamp.radius * vec2(length(lamp.column.xyz), length(lamp.row.xyz));
}

// No caster that can matter stands higher above the receiver's own 1 / z [m-1].
//
// widest : of the aperture's reach
float casters_above(Lamp lamp, LampReceiver r, float widest) {
    float high = lamp.hard_near - r.near;
    ivec2 cell = clamp(ivec2(r.place + 0.5), ivec2(0), ivec2(lamp_map_size - 1)) >> 3;
    int level, finer = caster_level(max(high, 0.0) * widest + 2.0), turn = 0;
    if (finer >= CASTER_LEVELS) return high;
    do {
        level = finer;
        ivec2 at = cell + ivec2(lamp.first_bounds + level * (lamp_map_size >> 3), 0);
        high = min(high, read_texel(lamp_bounds, at).g - r.near);
        finer = caster_level(max(high, 0.0) * widest + 2.0);
    } while (++turn < 3 && finer < level);
    return high;
}

// A line from a receiver to a point of the aperture. In X, Y and 1 / z it is straight, X grows by that
// point's own x for each 1 / z: the aperture is to a lamp's map what the Sun's disc is to its own.
//
// Near contact the disc shrinks below a texel; then the texel's own width smooths: the line begins at a
// distance from the receiver.
struct LampLine {
    vec2 slope;    // texels for each 1 / z over the receiver's own
    float steep;   // length of that
    vec2 along;    // unit, in its direction
    float blur;    // 1 / z over the receiver's own at which the disc is as wide as a texel [m-1]
};

// Height over the receiver [m-1], a difference in 1 / z, of a line so far from it on the map [texels].
float line_height(LampLine line, float away) {
    float height = away / line.steep;
    return sqrt(max(height * height - line.blur * line.blur, 0.0));
}

// Distance [texels] where a line stands so high over the receiver [m-1].
float line_distance(LampLine line, float height) {
    return line.steep * sqrt(height * height + line.blur * line.blur);
}

// How high over the receiver [m-1] its own surface may stand at an offset [texels] from it.
float receiver_plane(LampReceiver r, vec2 away) {
    return dot(r.plane, away) + r.slack * (1.0 + abs(away.x) + abs(away.y));
}

// Whether what a texel shows, so far from the receiver [texels], stands over that and casts soft shadows.
bool may_meet(Lamp lamp, LampReceiver r, vec4 texel, vec2 away) {
    return texel.r - r.near > receiver_plane(r, away) && texel.r <= lamp.hard_near;
}

// Whether a line meets what a texel shows, on its way between two heights over the receiver [m-1].
//
// A caster is in its way where it comes through the plane of the surface that the texel shows, or is below
// that while light has not left the solid yet.
bool line_meets(Lamp lamp, LampReceiver r, LampLine line, ivec2 at, float from, float to) {
    vec4 texel = read_texel(lamp_maps, at + ivec2(lamp.first, 0));
    vec2 away = vec2(at) - r.place, ends = texel.rg - r.near, slope = texel.ba;
    float plane = receiver_plane(r, away);
    if (!may_meet(lamp, r, texel, away)) return false;
    // Of the plane over the receiver, or over what lies a little towards the viewer.
    float over = min(ends.x - dot(slope, away), texel.r - r.seen.z - dot(slope, vec2(at) - r.seen.xy));
    // A solid that does not end over the receiver's surface reaches down to it; sheets have no inside.
    float low = ends.y >= plane ? ends.y : lamp.solid ? from : to;
    float inside = max(from, low);
    vec3 below = over + (dot(slope, line.slope) - 1.0) * vec3(from, to, inside);
    bool comes_through = (below.x > 0.0) != (below.y > 0.0);
    return comes_through || (inside < to && max(below.y, below.z) > 0.0);
}

// Whether casters stand as high as a line around a place on the map, within a reach of the bounds.
bool stands_around(Lamp lamp, LampReceiver r, vec2 place, int level, float height) {
    ivec2 cell = clamp(ivec2(place + 0.5), ivec2(0), ivec2(lamp_map_size - 1)) >> 3;
    ivec2 at = cell + ivec2(lamp.first_bounds + level * (lamp_map_size >> 3), 0);
    return read_texel(lamp_bounds, at).g - r.near > height;
}

// Whether a line from a receiver to the aperture meets a caster. It is followed from texel to texel, and
// in leaps where nothing around stands as high.
//
// high : of casters_above
bool line_blocked(Lamp lamp, LampReceiver r, LampLine line, float high) {
    vec2 side = sign(line.along);
    vec2 edge = (0.5 * side + 0.5) * float(lamp_map_size) - 0.5;
    vec2 room = max((edge - r.place) / line.along, 0.0);
    float away = line_distance(line, 0.0), end = min(line_distance(line, high), min(room.x, room.y));
    float from = 0.0;
    int level = FIRST_LEAP, looks = 0;
    bool blocked = false;
    do {
        vec2 place = r.place + line.along * away;
        if (looks == 0 && end - away > LEAPS[0]) {
            if (stands_around(lamp, r, place, level, from)) {
                looks = level == 0 ? int(LEAPS[0]) : 0;
                level = max(level - 2, 0);
            } else {
                away += LEAPS[level];
                from = line_height(line, away);
                level = min(level + 1, CASTER_LEVELS - 1);
            }
        } else {
            float stride = away / LOOKS;
            vec2 texel = floor(place + max(0.5 * stride - 0.5, 0.0) * line.along + 0.5);
            vec2 border = (texel + 0.5 * side - r.place) / line.along;
            away = max(min(border.x, border.y), away + stride) + 1e-3;
            float to = away < end ? line_height(line, away) : high;
            ivec2 at = clamp(ivec2(texel), ivec2(0), ivec2(lamp_map_size - 1));
            blocked = line_meets(lamp, r, line, at, from, to);
            from = to;
            looks = max(looks - 1, 0);
        }
    } while (!blocked && away < end);
    return blocked;
}

// Whether no texel within a reach [texels] of a receiver shows what may meet a line from there.
bool free_around(Lamp lamp, LampReceiver r, float reach) {
    ivec2 first = ivec2(floor(r.place - reach + 0.5)), last = ivec2(floor(r.place + reach + 0.5)), at = first;
    bool free = true;
    do {
        ivec2 texel = clamp(at, ivec2(0), ivec2(lamp_map_size - 1));
        free = !may_meet(lamp, r, read_texel(lamp_maps, texel + ivec2(lamp.first, 0)), vec2(texel) - r.place);
        bool ends = at.x == last.x;
        at = ends ? ivec2(first.x, at.y + 1) : at + ivec2(1, 0);
    } while (free && at.y <= last.y);
    return free;
}

// Share of the aperture that a surface sees past the casters of a lamp's map.
//
// high : of casters_above
float lit_by_aperture(Lamp lamp, LampReceiver r, float high) {
    if (r.flat_facet) {
        // It needs no lift over the triangle.
        high += r.near - r.foot.z;
        r.place = r.foot.xy;
        r.near = r.foot.z;
    }
    // Past the highest caster, not as high as it.
    high *= 1.01;
    vec2 reach = aperture_reach(lamp);
    float widest = max(reach.x, reach.y), blur = sqrt(0.6) / widest;
    // So far the lines go.
    float farthest = length(vec2(high * widest, sqrt(0.6))) + 1e-2;
    if (farthest < NEAR_LINES && free_around(lamp, r, farthest)) return 1.0;
    int lines = high * widest < WIDE_BLUR ? LAMP_LINES : 3 * LAMP_LINES, lit = 0;
    vec2 turn = fract(0.5 + vec2(dot(gl_FragCoord.xy, vec2(0.7548776662, 0.5698402910)),
                                 dot(gl_FragCoord.xy, vec2(0.8566748838, 0.7338918566))));
    vec2 direction = vec2(cos(6.28318531 * turn.x), sin(6.28318531 * turn.x));
    for (int k = 0; k < lines; ++k) {
        vec2 slope = sqrt((float(k) + turn.y) / float(lines)) * reach * direction + 1e-6;
        float steep = length(slope);
        lit += line_blocked(lamp, r, LampLine(slope, steep, slope / steep, blur), high) ? 0 : 1;
        direction = GOLDEN_TURN * direction;
    }
    return float(lit) / float(lines);
}

// Share of the lamp's light that reaches a surface past all casters.
//
// v : the surface from the lamp [m]
float lamp_lit(Surface s, Lamp lamp, vec3 v) {
    LampReceiver r = lamp_receiver(s, lamp, v);
    vec2 reach = aperture_reach(lamp);
    float widest = max(reach.x, reach.y), high = casters_above(lamp, r, widest);
    // Where the aperture spans less than a texel, only the texels smooth the edge.
    bool soft = high > r.slack && high * widest >= 1.0;
    float lit = lit_by_point(lamp, r, soft ? lamp.hard_near : 0.0);
    if (soft && lit > 0.0) lit *= lit_by_aperture(lamp, r, high);
    return lit;
}

// How the light of a lamp comes to a surface.
struct LampLight {
    Disc disc;
    float beam;     // intensity over that within the cone
    float facing;   // irradiance of a plane that faces it, by its intensity [m-2]
};

LampLight light_of(Surface s, Lamp lamp) {
    vec3 v = s.place - lamp.place, field = aperture_field(lamp, v);
    LampLight light;
    // The edge of the beam is that of a point in the middle of the aperture.
    light.beam = beam_profile(lamp, atan(length(cross(v, lamp.axis)), dot(v, lamp.axis)));
    light.facing = length(field);
    float radius = atan(lamp.radius, max(length(v), lamp.radius));
    light.disc = Disc(field / light.facing, radius, vec4(0.0), vec4(0.0));
    return light;
}

// Share of each lamp's light that reaches a surface past all casters.
vec4 lamps_lit(Surface s) {
    vec4 lit = vec4(1.0);
    Surface mapped = when_mapped(s);
    int i = 0;
    do {
        Lamp lamp = lamp_at(i);
        LampLight light = light_of(s, lamp_then(lamp, i, s.time));
        if (light.beam > 0.0) lit[i] = lamp_lit(mapped, lamp, mapped.place - lamp.place);
    } while (++i < lamp_count);
    return lit;
}

// Radiance of a lamp's light that a surface turns to the viewer, by its intensity [sr-1 m-2].
//
// lit : share of it that reaches the surface
vec4 reflected_lamp(Surface s, LampLight light, float lit) {
    vec3 wi = light.disc.wi;
    float facing = disc_cosine(dot(s.n, wi), light.disc.radius) * past_relief(s, wi);
    // With its centre below the surface's own horizon the disc is cut already.
    float reached = light.beam * facing * (dot(s.n, wi) > 0.0 ? lit : 1.0);
    vec4 reflected = vec4(0.0);
    if (reached > 0.0) reflected = reflection(s, light.disc) * (reached * light.facing);
    return reflected;
}

// Radiance of the lamps' light that a surface turns to the viewer [W m-2 sr-1].
//
// lit : share of each lamp's light that reaches it
vec4 lamp_light(Surface s, vec4 lit) {
    vec4 radiance = vec4(0.0);
    int i = 0;
    do {
        Lamp lamp = lamp_then(lamp_at(i), i, s.time);
        LampLight light = light_of(s, lamp);
#ifdef SPREAD_LIGHT
        // By a lamp that goes along with the camera.
        vec3 wi = light.disc.wi;
        vec4 reflected = vec4(0.0);
        Times times = spread_times(narrowest_lobe(s), s.place);
        float left = times.count;
        do {
            float time = spread_time(left, times);
            s.wo = spread_viewer(s.place, time);
            light.disc.wi = spread_lamp(wi, time);
            reflected += reflected_lamp(s, light, lit[i]);
        } while (--left > 0.0);
        radiance += reflected / times.count * lamp.intensity;
#else
        radiance += reflected_lamp(s, light, lit[i]) * lamp.intensity;
#endif
    } while (++i < lamp_count);
    return radiance;
}
