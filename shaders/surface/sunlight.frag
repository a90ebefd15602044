// Share of the sunlight that reaches each shading point of a spacecraft, per band. Drawn first for all,
// where the whole of the point's cell is lit or dark, or the Sun is a point to its casters; then, with
// SEARCH, sample by sample for the rest, one beside the other.
//
// With PLANES, planes over the casters tell where no caster stands: of most points near casters, where
// the texels of the map are small. The others follow, one beside the other, with NEIGHBOURS.
//
// With OF_SQUARES, of squares of 4 x 4 cells instead of points: whether light is smooth over each, and whether all
// of it is known to be lit or dark. With SEARCH, too, of the four points of a square that stand for 2 x 2 cells each.
//
// With IN_PLACE what follows is not listed, but drawn where it lies over what was drawn first.
#include "block/spacecraft"
#include "block/shadow"
#define GROUPED
#include "gbuffer/cells.glsl"
#include "surface/disc.glsl"
#include "surface/unknown_sunlight.glsl"
// A file is included once: here, since others include this one only where they are wanted.
#include "common/turn.glsl"
#ifdef MOVING
#include "common/moving.glsl"
#endif
#ifdef SPREAD_LIGHT
#include "common/light_spread.glsl"
#endif

#if defined(SEARCH) || defined(NEIGHBOURS)
#define SECOND
#endif
#if defined(OF_SQUARES) && !defined(SEARCH)
#define FIRST_OF_SQUARES
#endif

// The whole map, and right of it the close one where there is one.
#if defined(PLANES)
uniform sampler2D sun_planes;
#elif defined(FIRST_OF_SQUARES)
#elif defined(SLABS)
uniform sampler2D sun_slabs;
#else
uniform sampler2D sun_depths;
#endif
#if defined(SHEETS) && !defined(PLANES) && !defined(FIRST_OF_SQUARES)
uniform sampler2D sun_slopes;
#endif
#ifdef SECOND
#ifndef IN_PLACE
// Columns of the points, and from bit 16 on rows; behind the last all bits are set. Of a square's points the
// column counts on from four times that of the square.
uniform usampler2D searched_points;
#endif
#endif
#if defined(SECOND) && !defined(OF_SQUARES)
// What was drawn first.
uniform sampler2D sunlight;
#else
uniform sampler2D sun_tops;
#endif
#ifdef SEARCH
uniform sampler2D sun_behind;
#endif

// What the shading points see: targets of gbuffer/gbuffer.frag.
uniform sampler2D gbuffer_position;
uniform sampler2D gbuffer_normal_roughness;
uniform sampler2D gbuffer_face_normal;

#ifdef FIRST_OF_SQUARES
out uint even;   // as in simgl/passes/shading_points.py
const uint UNEVEN = 0u, LIT = 1u, DARK = 2u, PARTLY_LIT = 3u;
#else
out vec4 lit_fraction;
#endif
// Along an edge of what a receiver stands for.
#if defined(FIRST_OF_SQUARES)
const float CELLS = 4.0;
#elif defined(OF_SQUARES)
const float CELLS = 2.0;
#else
const float CELLS = 1.0;
#endif

// Cosine of incidence below which receiver_at moves a receiver all out of a surface's texels.
const float GRAZED = 1.0 / 60.0;

// Numbers 0..1 that spread evenly over any neighbourhood of samples, after the plastic number's
// relatives (M. Roberts 2018).
vec2 evenly_spread(vec2 sample_index) {
    return fract(0.5 + vec2(dot(sample_index, vec2(0.7548776662, 0.5698402910)),
                            dot(sample_index, vec2(0.8566748838, 0.7338918566))));
}

#ifdef OF_SQUARES
// Samples of 2 x 2 cells along an edge, each of which tries four directions.
const int EDGE_SAMPLES = 5;
#endif

// One of the two maps.
struct Atlas {
    SunMap map;
    float reach;        // texels per metre of height to the disc's edge
    mat4 from_body;     // column, row [texels], height [m]
};

// Chosen rather than indexed: each sample of an indexed block is a load of its own.
//
// lean : how far the Sun's light moves across it for each metre of height [m]
Atlas atlas_of(bool close, vec2 lean) {
    // Edge of a texel, top, depth, inset; size, column, column of the bounds, reach.
    vec4 frame = close ? shadow_frame[1] : shadow_frame[0];
    vec4 atlas = close ? shadow_atlas[1] : shadow_atlas[0];
    mat4 all_of_it = shadow_from_body[0], closer = shadow_from_body[1], from_body;
    for (int k = 0; k < 4; ++k) from_body[k] = close ? closer[k] : all_of_it[k];
    vec2 width = vec2(0.0);
#ifdef OF_SQUARES
    int taps = 4 * EDGE_SAMPLES * EDGE_SAMPLES;
#else
    int taps = int(shadow_taps);
#endif
#ifdef SLABS
    width = 1.0 / vec2(textureSize(sun_slabs, 0));
#endif
    SunMap map = SunMap(frame.x, frame.y, frame.z, int(atlas.x), int(atlas.y), int(atlas.z), width,
                        lean / frame.x, taps);
    return Atlas(map, atlas.w, from_body);
}

#ifdef PLANES
// Whether no caster stands over the samples of a receiver's cell, or square.
//
// steps : of the place from one sample to the next; reach : of the samples from its middle [texels]
bool is_free(SunMap map, Receiver r, mat2x3 steps, float reach) {
    // A plane of the map tells of 8 texels, and those that smooth an edge lie up to two from the samples.
    const float AROUND = 2.0;
    bool is_free = true;
#ifdef OF_SQUARES
    int parts = clamp(int(ceil(reach / (8.0 - AROUND))), 1, 4);
    mat2x3 cell_steps = steps * mat2(raster_from_cell.xy, raster_from_cell.zw);
    vec3 middle = r.here;
    reach /= float(parts);
    int k = 0;
    do {
        vec2 part = (vec2(k % parts, k / parts) + 0.5) / float(parts) - 0.5;
        r.here = middle + cell_steps * (CELLS * part);
        is_free = is_free && free_of_casters(sun_planes, map, r, reach + AROUND);
    } while (++k < parts * parts);
#else
    is_free = free_of_casters(sun_planes, map, r, reach + AROUND);
#endif
    return is_free;
}
#endif

#if defined(SEARCH) && defined(OF_SQUARES)
// In place of a lit fraction: it is not linear over the square.
const vec4 NOT_LINEAR = vec4(-1.0);
// Least radius of the Sun's disc at the lowest caster [cells]: a penumbra of twice the width is then linear
// between the points of a square to 0.4 % of full sunlight rms, 0.7 % at its ends.
const float SMOOTH_RADIUS = 12.0;
// Samples that lie evenly over 2 x 2 cells about a receiver, on a grid that is turned a little.
//
// cells : of the place from one cell to the next
Samples samples_of_cells(Receiver of_group, mat2x3 cells) {
    const float n = float(EDGE_SAMPLES), next = CELLS / n, shift = next / n;
    mat2x3 steps = cells * mat2(next, -shift, shift, next);
    vec2 first = vec2(0.5 * shift, next - 0.5 * shift) - 0.5 * CELLS;
    uint group = (1u << uint(EDGE_SAMPLES * EDGE_SAMPLES)) - 1u;
    return Samples(of_group, steps, of_group.here + cells * first, group, EDGE_SAMPLES * EDGE_SAMPLES);
}
#endif

#if !defined(PLANES) && !defined(SEARCH) && !defined(OF_SQUARES)
// Lit share of a group of samples to whose casters the Sun is a point.
//
// highest : that a caster may stand over them [m]
float lit_near(SunMap map, Receiver of_group, mat2x3 steps, uint group, float highest) {
    uint left = group;
    vec2 middle = point_of(group);
    vec2 offset = to_surface(map, of_group) + lean_past(sun_depths, map, of_group, highest);
    float lit = 0.0;
    do {
        Receiver receiver = of_group;
        receiver.here += steps * (vec2(next_texel(left)) + 0.5 - middle);
#ifdef SHEETS
        lit += lit_past_planes(sun_depths, sun_slopes, map, receiver, offset, 1e9);
#else
        lit += lit_by_neighbours(sun_depths, map, receiver, offset);
#endif
    } while (left != 0u);
    return lit / float(samples_of(group));
}
#endif

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
#ifdef SECOND
#ifdef IN_PLACE
    float known_by = read_texel(sunlight, at).x;
#ifdef SEARCH
    if (known_by != SEARCH_TELLS) discard;
#else
    if (known_by != NEIGHBOURS_TELL) discard;
#endif
#else
    uint point = read_texel(searched_points, at).r;
    if (point == ~0u) discard;
    at = ivec2(point & 65535u, point >> 16u);
#ifdef OF_SQUARES
    ivec2 quarter = ivec2(at.x & 1, (at.x >> 1) & 1);
    at.x >>= 2;
#endif
#endif
#endif
    vec3 wi = sun_direction.xyz;
    vec2 lean = shadow_lean;
    vec4 position = read_texel(gbuffer_position, at);
    vec3 body = position.xyz;
    vec4 normal_roughness = read_texel(gbuffer_normal_roughness, at);
    vec4 face_normal = read_texel(gbuffer_face_normal, at);
    vec3 n = normalize(normal_roughness.xyz), facet = normalize(face_normal.xyz);
    vec3 place = (camera_from_body * vec4(body, 1.0)).xyz;
    mat3 body_from_camera = transpose(mat3(camera_from_body));
#ifdef MOVING
    float time = seen_time(body, vec3(0.0));
    mat4 pose = pose_at(time);
    place = (pose * vec4(body, 1.0)).xyz;
    body_from_camera = transpose(mat3(pose));
#endif
    if (dot(facet, place) > 0.0) facet = -facet;
    // Steps of the place from one sample to the next: over the triangle's plane in camera axes, then
    // in body axes.
    mat2x3 body_steps = mat2x3(
        body_from_camera * place_step(place, facet, sample_steps[0].xyz),
        body_from_camera * place_step(place, facet, sample_steps[1].xyz));
#ifdef MOVING
    wi = light_at(wi, time);
#endif
#ifdef SPREAD_LIGHT
    wi = spread_light(wi, shadow_time(place));
#endif
#ifdef MOVING
    // Seen from the body, in the camera's axes of the middle of the exposure's part.
    mat3 to_middle = mat3(camera_from_body) * body_from_camera;
    n = to_middle * n;
    facet = to_middle * facet;
    wi = normalize(to_middle * wi);
#endif
#if defined(MOVING) || defined(SPREAD_LIGHT)
    vec3 to_sun = mat3(light_from_camera) * wi;
    lean = to_sun.xy / to_sun.z;
#endif
    mat2 raster_steps = mat2(raster_from_cell.xy, raster_from_cell.zw);
#if defined(SEARCH) && defined(OF_SQUARES)
    body += body_steps * (raster_steps * (CELLS * (vec2(quarter) - 0.5)));
#endif
    vec2 inside = (shadow_from_body[1] * vec4(body, 1.0)).xy;
    inside = min(inside, shadow_atlas[1].x - inside);
    bool close = min(inside.x, inside.y) > shadow_frame[1].w;
    Atlas atlas = atlas_of(close, lean);
    vec3 here = (atlas.from_body * vec4(body, 1.0)).xyz;
    mat2x3 steps = mat2x3(mat3(atlas.from_body) * body_steps[0], mat3(atlas.from_body) * body_steps[1]);
    // Facets that already face away use the plane of the smooth surface, and those that the light
    // grazes where it is less steep: along them no texel tells what casts.
    vec3 plain_n = mat3(light_from_camera) * n;
    float grazing = dot(facet, wi);
    bool steep = grazing <= 0.0 || grazing < min(dot(n, wi) - 1e-3, GRAZED);
    vec3 plane = steep ? plain_n : mat3(light_from_camera) * facet;
    // Where the surface faces away no light is asked for.
    bool away = dot(n, wi) <= 0.0;
    vec3 to_viewer = mat3(light_from_camera) * normalize(-place);
    // All samples of a group see one plane.
    Receiver of_group = receiver_at(atlas.map, here, plane, plain_n, to_viewer);
#if !defined(PLANES) && !defined(OF_SQUARES)
    uint group = group_of(at);
#endif
    // So far the cell's samples lie from its middle [texels of the map].
    vec2 spread = CELLS * cell_reach * (abs(steps[0].xy) + abs(steps[1].xy));
    float sample_reach = max(spread.x, spread.y);
#if defined(SECOND) && !defined(OF_SQUARES)
    float highest = read_texel(sunlight, at).y;
#else
    Around around = casters_around(sun_tops, atlas.map, of_group, atlas.reach, sample_reach);
    float highest = around.high;
#endif
#ifdef SEARCH
#ifdef OF_SQUARES
    mat2x3 cells = steps * raster_steps;
    Samples samples = samples_of_cells(of_group, cells);
    vec2 turn = evenly_spread(vec2(2 * at + quarter));
#else
    vec3 corner = of_group.here + steps * (0.5 - point_of(group));
    Samples samples = Samples(of_group, steps, corner, group, int(samples_of(group)));
    vec2 turn = evenly_spread(vec2(cell_of_point(at)));
#endif
#ifdef SLABS
#define sun_depths sun_slabs
#endif
    float past = 1.0;
#ifdef SHEETS
    // Samples in the crease of sheets are dark; the others are searched.
    samples.group = past_planes(sun_depths, sun_slopes, atlas.map, samples, atlas.reach);
    past = 1.0 / float(samples.count);
    samples.count = int(samples_of(samples.group));
    past *= float(samples.count);
#endif
    float lowest = 0.0;
    lit_fraction = vec4(0.0);
    if (past > 0.0)
        lit_fraction = past * disc_past(sun_depths, sun_behind, atlas.map, samples, highest, atlas.reach,
                                        sun_limb_u, sun_limb_v, turn, lowest);
#ifdef OF_SQUARES
    bool partly = lit_fraction.g > 0.0 && lit_fraction.g < 1.0;
    float cell = max(length(cells[0].xy), length(cells[1].xy));
    if (partly && (past < 1.0 || lowest * atlas.reach < SMOOTH_RADIUS * cell)) lit_fraction = NOT_LINEAR;
    if (around.near) lit_fraction = NOT_LINEAR;
    else if (!around.search) lit_fraction = vec4(around.dark ? 0.0 : 1.0);
#endif
#elif defined(NEIGHBOURS)
    lit_fraction = vec4(lit_near(atlas.map, of_group, steps, group, highest));
#else
    bool unknown = around.near;
#ifdef PLANES
    unknown = unknown && !is_free(atlas.map, of_group, steps, sample_reach);
#endif
#ifdef OF_SQUARES
    // Near the surface's own horizon light is not smooth.
    bool level = abs(dot(n, wi)) < sun_angular_radius + sqrt(6.0 * normal_roughness.w);
    bool smooth_light = face_normal.w > 0.5 && !level;
    even = away || around.dark ? DARK : around.search ? PARTLY_LIT : unknown ? UNEVEN : LIT;
    if (!smooth_light) even = UNEVEN;
#else
    lit_fraction = vec4(around.dark || away ? 0.0 : 1.0);
#ifdef PLANES
    if (unknown && !away) lit_fraction.xy = vec2(NEIGHBOURS_TELL, highest);
#else
    // llvmpipe works the others out with these, sample by sample.
    bool near = unknown && !away && uint(position.w) / 16384u == instance;
    float lit = lit_near(atlas.map, of_group, steps, near ? group : lowest_of(group), highest);
    if (near) lit_fraction = vec4(lit);
#endif
    if (around.search && !away) lit_fraction.xy = vec2(SEARCH_TELLS, highest);
#endif
#endif
}
