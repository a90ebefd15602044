// The shading points of a tile: for each group of samples that see the same smooth surface the place,
// normals, material and light of vertices where the line of sight through the samples' middle meets it.
//
// Of the points that gbuffer/marks.frag has marked; with MARK_AT, where all points see one spacecraft, it
// marks them itself. EDGES: instead, the line along which the group ends in its cell. OF_SQUARES: instead of
// points, squares of 4 x 4 cells, or LARGER ones of 8 x 8, that show one smooth surface, and whether light is smooth over them.
#define GROUPED
#include "block/spacecraft"
#include "gbuffer/cells.glsl"
#include "gbuffer/triangles.glsl"
#ifdef JOINTED
#include "common/joints.glsl"
#endif
#ifdef MOVING
#include "common/moving.glsl"
#endif
#ifdef JOINTS_MOVE
#include "common/joint_rates.glsl"
#endif
#if defined(DETAILED) || defined(LAYERED) || defined(OF_SQUARES)
#include "block/materials"
#endif
#ifdef DETAILED
#include "gbuffer/detail.glsl"
#endif
#if defined(LAYERED) || defined(OF_SQUARES)
#include "surface/layers.glsl"
#endif

uniform usampler2D seen_triangles, seen_surfaces;
// Rows of texels: place as stored and label; normal as stored. With DETAILED besides: place in the
// images; factors of the base colour.
uniform sampler2D mesh_vertices;
#ifdef DETAILED
const uint VERTEX_TEXELS = 4u;
#else
const uint VERTEX_TEXELS = 2u;
#endif
#ifdef TWO_SIDED
const uint SIDES = 2u;
#else
const uint SIDES = 1u;
#endif
#ifdef INTERREFLECTION
// For each side irradiance from other surfaces [W m-2], and what they leave of the Earth's.
uniform sampler2D vertex_light;
#endif
#ifdef LIGHT_GRIDS
#include "gbuffer/light_grids.glsl"
#endif

#ifdef EDGES
layout(location = 0) out vec4 group_edge;   // as `edge_of`
vec4 position, normal_roughness, face_normal, indirect, textured_reflectance, textured_emission, textured_normal;
#else
// Body axes [m]; label plus 16384 times the spacecraft's number.
layout(location = 0) out vec4 position;
// Normal, camera axes; its spread in the group's part of the cell (gbuffer/normal_spread.glsl).
layout(location = 1) out vec4 normal_roughness;
// Normal of the triangle, camera axes; fraction of the Earth's light that reaches the point.
layout(location = 2) out vec4 face_normal;
// Irradiance from other surfaces [W m-2].
layout(location = 3) out vec4 indirect;
#ifdef DETAILED
layout(location = 4) out vec4 textured_reflectance;
layout(location = 5) out vec4 textured_emission;   // share of the material's in R, G, B; metallic
layout(location = 6) out vec4 textured_normal;     // with the images' relief, 1 to 2 long; alpha^2
#endif
#endif

#include "gbuffer/facet.glsl"
#include "gbuffer/normal_spread.glsl"
#ifdef EDGES
#include "gbuffer/edge.glsl"
#endif

// Roughness of the normals within a shading point's part of the cell, alpha^2 of a microfacet lobe: the mean,
// how uneven as a share of it, and twice the angle of the direction in which they spread most [rad].
// Normals that turn evenly by w have in their middle the density of a lobe with alpha^2 = w^2 / pi; a lobe so
// widened is the mean over the cell (after Tokuyoshi & Kaplanyan 2019, whose cap of 0.18 keeps silhouettes,
// where the expansion fails, from going dull).
vec3 cell_roughness(vec3 n, vec3 du, vec3 dv) {
    mat2x3 axes = square_to(n);
    vec2 u = du * axes, v = dv * axes;
    vec2 squares = (u * u + v * v) / 3.0;
    float mixed = 2.0 * (u.x * u.y + v.x * v.y) / 3.0, differ = squares.x - squares.y;
    float mean = 0.5 * (squares.x + squares.y), uneven = 0.5 * length(vec2(differ, mixed));
    vec2 ends = min(mean + vec2(uneven, -uneven), 0.18);
    mean = 0.5 * (ends.x + ends.y);
    return vec3(mean, mean > 0.0 ? clamp(0.5 * (ends.x - ends.y) / mean, 0.0, 1.0) : 0.0, atan(mixed, differ));
}

#ifdef DETAILED
// The mean of what images and vertex colours say of the group's samples. Returns the roughness of
// their normals, alpha^2.
float detail(uint group, vec2 first, Facet facet, mat3 normals, uvec3 corner, uint material, bool back) {
    mat3x2 uv;
    mat3x4 tint;
    for (int k = 0; k < 3; ++k) {
        uv[k] = read_texel(mesh_vertices, table_place(VERTEX_TEXELS * corner[k] + 2u)).xy;
        tint[k] = read_texel(mesh_vertices, table_place(VERTEX_TEXELS * corner[k] + 3u));
    }
    float share = 1.0 / float(samples_of(group));
    textured_reflectance = textured_emission = textured_normal = vec4(0.0);
    vec3 mean_n = vec3(0.0);
    uint left = group;
    do {
        vec3 sight = sight_at(first + vec2(next_texel(left)) + 0.5);
        vec3 w = weights_at(facet, sight);
        vec3 w_u = weights_at(facet, sight + sample_steps[0].xyz) - w;
        vec3 w_v = weights_at(facet, sight + sample_steps[1].xyz) - w;
        mat2x3 edges = mat2x3(facet.along, facet.up);
        Textured t = textured_at(material, normalize(normals * w), Cell(uv * w, uv * w_u, uv * w_v),
                                 tint * w, edges * w_u.yz, edges * w_v.yz, back);
        textured_reflectance += share * t.reflectance;
        textured_emission += share * vec4(t.emission, t.metallic);
        textured_normal.w += share * t.roughness2;
        mean_n += share * t.n;
    } while (left != 0u);
    textured_normal.xyz = normalize(mean_n);
    // As for an image's relief (Toksvig 2005).
    float shortened = length(mean_n);
    return 2.0 * max(1.0 - shortened, 0.0) / shortened;
}
#endif

// The sample of a group that is nearest to its middle.
ivec2 nearest_of(uint group, vec2 middle) {
    ivec2 nearest = ivec2(0);
    float nearest2 = 1e9;
    uint left = group;
    do {
        ivec2 texel = next_texel(left);
        vec2 away = vec2(texel) + 0.5 - middle;
        float distance2 = dot(away, away);
        if (distance2 < nearest2) nearest = texel;
        nearest2 = min(nearest2, distance2);
    } while (left != 0u);
    return nearest;
}

// A part of the raster that has one shading point.
struct Part {
    vec2 middle;     // place of its line of sight
    ivec2 texel;     // nearest to it: the triangle that is seen there is that of all
    float edge;      // as a square
    vec2 first;      // corner of its cell's window
    ivec2 cell;
    uint group;
};

// The part of a group.
Part part_of(ivec2 cell, uint group) {
    vec2 first = vec2(first_texel(cell)), middle = point_of(group);
    ivec2 texel = ivec2(first) + nearest_of(group, middle);
    return Part(first + middle, texel, sqrt(float(samples_of(group))), first, cell, group);
}

// What a sample of the raster sees of its triangle.
struct Seen {
    uint triangle;
    uvec3 corner;        // numbers of its vertices
    bool back;
    uint label;
    mat3 places;         // of these, body axes, in the middle of the exposure's part [m]
    mat3 normals;        // camera axes, on the side that is seen
    Facet facet;         // now
};

// pose, time : of the spacecraft, and of the place's row
Seen seen_at(ivec2 texel, mat4 pose, float time) {
    Seen s;
    s.triangle = max(read_texel(seen_triangles, texel).r, 1u) - 1u;
    s.corner = corners_of(s.triangle);
    s.back = (read_texel(seen_surfaces, texel).r & 1u) == 1u;
    s.label = 0u;
    mat3 present;
    for (int k = 0; k < 3; ++k) {
        vec4 place = read_texel(mesh_vertices, table_place(VERTEX_TEXELS * s.corner[k]));
        vec3 direction = read_texel(mesh_vertices, table_place(VERTEX_TEXELS * s.corner[k] + 1u)).xyz;
        s.label = uint(place.w);
#ifdef JOINTED
        place.xyz = place_from_stored(place.xyz, s.label);
        direction = direction_from_stored(direction, s.label);
#endif
        s.places[k] = present[k] = place.xyz;
#ifdef JOINTS_MOVE
        present[k] += time * rate_of_place(place.xyz, s.label);
#endif
        s.normals[k] = s.back ? -direction : direction;
    }
    s.normals = mat3(pose) * s.normals;
    vec3 a = (pose * vec4(present[0], 1.0)).xyz;
    vec3 along = mat3(pose) * (present[1] - present[0]);
    vec3 up = mat3(pose) * (present[2] - present[0]);
    s.facet = Facet(a, along, up, cross(along, up));
    return s;
}

#ifdef INTERREFLECTION
// Irradiance from other surfaces [W m-2] at weights of the corners.
//
// earth_share : fraction of the Earth's light that reaches the place
vec4 light_of_others(Seen s, vec3 weight, out float earth_share) {
    vec4 light = vec4(0.0);
    earth_share = 0.0;
    for (int k = 0; k < 3; ++k) {
        uint row = 2u * (SIDES * s.corner[k] + uint(s.back) % SIDES);
        light += weight[k] * read_texel(vertex_light, table_place(row));
        earth_share += weight[k] * read_texel(vertex_light, table_place(row + 1u)).r;
    }
#ifdef LIGHT_GRIDS
    light = max(light + more_of_grid(s.triangle, max(weight, 0.0), s.back), 0.0);
#endif
    return light;
}
#endif

#ifdef OF_SQUARES
// Of each block of cells (gbuffer/pages.frag).
uniform usampler2D blocks;

// Of a square [cells].
#ifdef LARGER
const int EDGE = 8;
#else
const int EDGE = 4;
#endif

// Over a square light is taken for linear between four points, and a little beyond them. A function of second
// derivative f then errs by 0.04 f w^2 over a width w: a lobe of width alpha by 0.16 (w / alpha)^2 of its peak,
// and what goes by the cosine to the viewer by 0.04 (w / cosine)^2. With these by 2e-4 at most.
const float OF_LOBE = 0.035, OF_COSINE = 0.07;
// Where triangles meet light of other surfaces bends: its mean over two opposite corners of a square differs from
// that in the middle by so much of it at most. Beside one bend it then errs by 1.25 times as much at most.
const float OF_BEND = 2e-3;
// And they lie in one plane, but for so much of a unit normal.
const float OF_PLANE = 1e-3;

// A place of a square by the part of its edge from the middle, in the raster.
vec2 place_in_square(vec2 middle, vec2 part) {
    return middle + mat2(raster_from_cell.xy, raster_from_cell.zw) * (float(EDGE) * part);
}

// Whether light that comes from all over the sky, or from the Sun, is smooth over a square.
//
// turn : of the normals over the square
bool is_smooth(vec3 n, vec3 sight, float turn, uint material) {
    vec4 law = material_law[material];
    float alpha = law.z > 0.5 ? 1.0 : law.y * law.y;
    float width = float(EDGE) * length(raster_from_cell.xy) * length(sample_steps[0].xyz);
    return turn + width < OF_LOBE * alpha && width < OF_COSINE * abs(dot(n, normalize(sight)))
        && !is_layered(material);
}

// Whether the light of other surfaces is linear over a square of a triangle.
bool is_linear(Seen seen, vec2 middle) {
    bool linear = true;
#ifdef LIGHT_GRIDS
    GridPlace at = grid_place(weights_at(seen.facet, sight_at(middle)));
    for (int k = 0; k < 4; ++k) {
        vec2 place = place_in_square(middle, vec2(k & 1, k >> 1) - 0.5);
        linear = linear && is_linear(at, grid_place(max(weights_at(seen.facet, sight_at(place)), 0.0)));
    }
    linear = linear || read_texel(light_grids, table_place(seen.triangle)).r == 0u;
#endif
    return linear;
}

// Whether it is nearly so over a square of several triangles in one plane: from its middle and corners.
//
// seen, n, light, earth_share : of the middle; turn : of the normals over the square, made larger
bool is_nearly_linear(Seen seen, vec3 n, vec2 middle, vec4 light, float earth_share, inout float turn) {
    vec4 bends[2] = vec4[](light, light);
    vec2 share_bends = vec2(earth_share);
    vec3 plane = normalize(seen.facet.across);
    bool flat_square = true;
    for (int k = 0; k < 4; ++k) {
        vec2 place = place_in_square(middle, 0.9 * (vec2(k & 1, k >> 1) - 0.5));
        Seen s = seen_at(ivec2(place), camera_from_body, 0.0);
        vec3 weight = weights_at(s.facet, sight_at(place));
        flat_square = flat_square && distance(normalize(s.facet.across), plane) < OF_PLANE;
        turn = max(turn, 2.0 * distance(normalize(s.normals * weight), n));
#ifdef INTERREFLECTION
        float share;
        int diagonal = (k + 1) >> 1 & 1;
        bends[diagonal] -= 0.5 * light_of_others(s, weight, share);
        share_bends[diagonal] -= 0.5 * share;
#endif
    }
    bool linear = true;
#ifdef INTERREFLECTION
    for (int k = 0; k < 2; ++k)
        linear = linear && dot(abs(bends[k]), vec4(1.0)) <= OF_BEND * dot(light, vec4(1.0))
              && abs(share_bends[k]) < OF_BEND;
#endif
    return flat_square && linear;
}

// Whether a square, and a texel around it, shows one triangle: as its corners do, for triangles are convex.
bool is_of_one_triangle(uint triangle, vec2 middle) {
    ivec2 last = textureSize(seen_triangles, 0) - 1;
    float corner = 0.5 + 1.0 / (float(EDGE) * length(raster_from_cell.xy));
    bool one = true;
    for (int k = 0; k < 4; ++k) {
        ivec2 texel = ivec2(place_in_square(middle, corner * (2.0 * vec2(k & 1, k >> 1) - 1.0)));
        one = one && read_texel(seen_triangles, clamp(texel, ivec2(0), last)).r == triangle + 1u;
    }
    return one;
}

// Whether all light is smooth over a square, of whose middle the light is known.
//
// n, sight : there; turn : of the normals over the square, by those of its triangle
bool is_even(Seen seen, vec3 n, vec3 sight, float turn, vec2 middle) {
    const int BLOCKS = EDGE / BLOCK;
    ivec2 first = BLOCKS * ivec2(gl_FragCoord.xy);
    uint all = ~0u;
    for (int k = 0; k < BLOCKS * BLOCKS; ++k) all &= read_texel(blocks, first + ivec2(k % BLOCKS, k / BLOCKS)).r;
    bool one_surface = (all & BLOCK_ONE_SURFACE) != 0u;
    bool even = one_surface && is_of_one_triangle(seen.triangle, middle) && is_linear(seen, middle);
    float earth_share = face_normal.w;
    vec4 light = indirect;
    // A loop, which llvmpipe leaves where an if would be worked out.
    for (bool several = one_surface && !even; several; several = false)
        even = is_nearly_linear(seen, n, middle, light, earth_share, turn);
    return even && is_smooth(n, sight, turn, seen.label & 63u);
}
#endif

// Returns the material.
uint look_up(Part part) {
    vec3 sight = sight_at(part.middle), seen_sight = sight_at(vec2(part.texel) + 0.5);
    mat4 pose = camera_from_body;
    float time = 0.0;
#ifdef MOVING
    time = time_of(sight);
    pose = pose_at(time);
#endif
    Seen seen = seen_at(part.texel, pose, time);
    Facet facet = seen.facet;
    mat3 places = seen.places, normals = seen.normals;
    uint label = seen.label;

    vec3 weight = weights_at(facet, sight);
    vec2 parts = weights_at(facet, seen_sight).yz + parts_between(facet, seen_sight, sight);
    position = vec4(places[0] + parts.x * (places[1] - places[0]) + parts.y * (places[2] - places[0]),
                    float(16384u * instance + label));
    vec3 n = normalize(normals * weight);
    vec3 du = part.edge * sample_steps[0].xyz, dv = part.edge * sample_steps[1].xyz;
    vec3 n_u = normalize(normals * weights_at(facet, sight + du)) - n;
    vec3 n_v = normalize(normals * weights_at(facet, sight + dv)) - n;
    vec3 spread = cell_roughness(n, n_u, n_v);
#ifdef DETAILED
    float relief = detail(part.group, part.first, facet, normals, seen.corner, label & 63u, seen.back);
    // By its length the share of what the triangles' own normals make of the spread.
    textured_normal.xyz *= relief > spread.x ? 1.0 + spread.x / relief : 2.0;
    spread.x = max(spread.x, relief);
#endif
    normal_roughness = vec4(n, 0.0);
#ifdef EDGES
    group_edge = edge_of(part.cell, part.group, facet);
    return 0u;
#endif
    float area = length(facet.across);
    face_normal = vec4(area > 0.0 ? facet.across / area : n, 1.0);
    indirect = vec4(0.0);
#ifdef INTERREFLECTION
    // Not past the edges, where light may change within a triangle's width.
    vec3 inside = max(weight, 0.0);
    inside /= inside.x + inside.y + inside.z;
    indirect = light_of_others(seen, inside, face_normal.w);
#endif
#ifdef OF_SQUARES
    face_normal.w = float(is_even(seen, n, sight, sqrt(6.0 * spread.x), part.middle));
#endif
    store_spread(normal_roughness, face_normal, spread);
    return label & 63u;
}

#ifdef EDGES
void main() {
    ivec2 at = ivec2(gl_FragCoord.xy), cell = cell_of_point(at);
    uint group = group_of(at);
    group_edge = vec4(0.0);
    // Most groups fill their cell. A loop, which llvmpipe leaves where an if would be worked out.
    bool ends = group != 0u && samples_of(group) < read_texel(cell_groups, cell).x >> TEXELS;
    for (; ends; ends = false) look_up(part_of(cell, group));
}
#elif defined(OF_SQUARES)
void main() {
    vec2 middle = raster_place(float(EDGE) * gl_FragCoord.xy);
    ivec2 texel = clamp(ivec2(middle), ivec2(0), textureSize(seen_surfaces, 0) - 1);
    float edge = float(EDGE) * length(raster_from_cell.xy);
    look_up(Part(middle, texel, edge, vec2(0.0), ivec2(0), 1u));
}
#else
void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    int width;
    ivec2 cell = cell_of_point(at, width);
    uint group = group_of(at);
    Part part = part_of(cell, max(group, 1u));
    if (width > 1) {
        part.middle = raster_place(vec2(cell) + 0.5 * float(width));
        part.texel = ivec2(part.middle);
        part.edge = length(raster_from_cell.xy);
    }
    uint material = look_up(part);
#ifdef MARK_AT
    const float MARK = 0.5 + 0.5 * MARK_AT;
    bool other_side = false;
#ifdef LAYERED
    other_side = is_layered(material);
#endif
    gl_FragDepth = group == 0u ? gl_FragCoord.z : other_side ? 1.0 - MARK : MARK;
#endif
}
#endif
