#include "common/texels.glsl"
#include "gbuffer/normal_spread.glsl"
#include "gbuffer/page_places.glsl"
#include "surface/layers.glsl"
#include "surface/material.glsl"
// A file is included once: here, since others include this one only where they are wanted.
#include "common/turn.glsl"
#ifdef MOVING
#include "common/moving.glsl"
#endif
#ifdef SPREAD_LIGHT
#include "common/light_spread.glsl"
#endif
#ifdef LAYERED
#define GROUPED
#include "gbuffer/cells.glsl"
#ifdef JOINTED
#include "common/joints.glsl"
#endif
#endif

// What the shading points see: the targets of gbuffer/gbuffer.frag.
uniform sampler2D gbuffer_position;
uniform sampler2D gbuffer_normal_roughness;
uniform sampler2D gbuffer_face_normal;
#ifdef INTERREFLECTION
uniform sampler2D gbuffer_indirect;
#endif
#ifdef DETAILED
uniform sampler2D textured_reflectance;
uniform sampler2D textured_emission;
uniform sampler2D textured_normal;
#endif

#ifdef JOINTED
// Patterns lie where the surface is stored.
void turn_back(inout Surface s, uint label) {
    s.pattern = stored_from_place(s.pattern, label);
    s.pattern_from_camera = stored_from_turned(label) * s.pattern_from_camera;
}
#endif

// The surface that a shading point sees.
Surface gbuffer_surface(ivec2 at) {
    vec4 position = read_texel(gbuffer_position, at);
    vec4 normal_roughness = read_texel(gbuffer_normal_roughness, at);
    vec4 face_normal = read_texel(gbuffer_face_normal, at);
    uint material = material_of(position.w);
    Surface s;
    s.body = position.xyz;
    mat4 pose = camera_from_body;
    s.time = 0.0;
#ifdef MOVING
    s.time = seen_time(s.body, vec3(0.0));
    pose = pose_at(s.time);
#endif
    s.place = (pose * vec4(s.body, 1.0)).xyz;
    s.wo = normalize(-s.place);
    NormalSpread spread = stored_spread(normal_roughness, face_normal.xyz);
    s.facet = normalize(dot(face_normal.xyz, s.wo) < 0.0 ? -face_normal.xyz : face_normal.xyz);
    s.n = normalize(normal_roughness.xyz);
    s.plain_n = s.n;
    vec4 law = material_law[material];   // metallic, roughness, 1 if Lambertian, 1 if it conserves
    s.reflectance = material_reflectance[material];
    s.metallic = law.x;
    s.emission = material_emission[material];
    float roughness2 = pow(law.y, 4.0);
#ifdef DETAILED
    vec4 emission = read_texel(textured_emission, at);
    vec4 relief = read_texel(textured_normal, at);
    s.reflectance = read_texel(textured_reflectance, at);
    s.metallic = emission.w;
    s.emission *= emission.rgbr;
    s.n = normalize(relief.xyz);
    spread.turn *= sqrt(clamp(length(relief.xyz) - 1.0, 0.0, 1.0));
    roughness2 = relief.w;
#endif
    s.alpha = sqrt(roughness2 + spread.mean);
    s.turn = spread.turn;
    s.axis = spread.axis;
    s.lambertian = law.z > 0.5;
    s.coat = 0.0;
    s.coat_alpha = 1.0;
    s.gain = vec4(1.0);
    s.earth_share = face_normal.w;
    s.indirect = vec4(0.0);
#ifdef INTERREFLECTION
    s.indirect = read_texel(gbuffer_indirect, at);
#endif
    // Uniform over the hemisphere, unless rays tell more.
    s.seen = s.coat_seen = s.indirect / PI;
    s.sky_share = s.coat_sky_share = s.earth_share;
#ifdef LAYERED
    s.pattern = s.body;
    s.pattern_from_camera = transpose(mat3(pose));
#ifdef JOINTED
    turn_back(s, uint(position.w) % 16384u);
#endif
    vec4 layers = material_layers[material];   // of the coat: strength, roughness; of the crinkle
    s.coat = layers.x;
    s.coat_alpha = sqrt(pow(layers.y, 4.0) + spread.mean);
#endif
    return s;
}

#ifdef LAYERED
// What all samples of a group have of their material's patterns.
struct Pattern {
    vec3 dx, dy;   // steps of the place to the neighbouring samples, camera axes [m]
    vec3 box;      // of a sample's footprint, along the pattern's axes [m]
    bool cells, facetted, conserving;
    float facet;   // mean spacing of the large ones of a crinkle [m]
    Crinkle facets;
};

// The same; the surface gets what it makes of the lobes.
Pattern pattern_of(inout Surface s, uint material) {
    vec4 layers = material_layers[material];
    Pattern p;
    p.cells = material_cells[material].x > 0.0;
    p.conserving = material_law[material].w > 0.5;
    p.dx = place_step(s.place, s.facet, sample_steps[0].xyz);
    p.dy = place_step(s.place, s.facet, sample_steps[1].xyz);
    p.box = abs(s.pattern_from_camera * p.dx) + abs(s.pattern_from_camera * p.dy);
    p.facet = layers.z;
    p.facets = Crinkle(vec2(0.0), 0.0);
    if (p.facet > 0.0) {
        float footprint = sqrt(max(dot(p.dx, p.dx), dot(p.dy, p.dy)));
        p.facets = crinkle_of(footprint, p.facet, layers.w);
        s.alpha = sqrt(widened(s.alpha * s.alpha, p.facets.hidden));
        s.coat_alpha = sqrt(widened(s.coat_alpha * s.coat_alpha, p.facets.hidden));
    }
    p.facetted = p.facets.shares.x > 0.0;
    return p;
}

// The surface that one sample of a shading point's group sees, with the patterns of its material.
//
// offset : of the sample from the shading point, in the raster
Surface sample_surface(Surface s, uint material, Pattern p, vec2 offset) {
    vec3 step = offset.x * p.dx + offset.y * p.dy;
    s.place += step;
    s.pattern += s.pattern_from_camera * step;
    if (p.cells) lay_cells(s, material, p.box);
    if (p.facetted) crumple(s, p.facet, p.facets);
    if (p.conserving) s.gain = scattered_again(normal_reflectance(s), viewer_cosine(s), s.alpha);
    return s;
}
#endif
