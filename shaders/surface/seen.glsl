#include "surface/material.glsl"
#ifdef LAYERED
#include "block/tile"
#ifdef JOINTED
#include "common/joints.glsl"
#endif
#endif

// What the samples see: the targets of gbuffer/gbuffer.frag.
uniform sampler2D seen_place;
uniform sampler2D seen_shape;
uniform sampler2D seen_plane;
#ifdef EXCHANGE
uniform sampler2D seen_others;
#endif
#ifdef DETAILED
uniform sampler2D worn_reflectance;
uniform sampler2D worn_emission;
uniform sampler2D worn_normal;
#endif

uint material_of(float label) {
    return uint(label) & 63u;
}

#ifdef JOINTED
// Patterns lie where the surface is stored.
void turn_back(inout Surface s, uint label) {
    s.pattern = stored_from_place(s.pattern, label);
    s.pattern_from_camera = stored_from_turned(label) * s.pattern_from_camera;
}
#endif

// Whether a material is more than one reflection law, the same all over.
bool is_layered(uint material) {
    vec4 layers = material_layers[material];
    return max(max(layers.x, layers.z), material_cells[material].x) > 0.0
        || material_law[material].w > 0.5;
}

#ifdef LAYERED
// Step of the place from one sample to the next, on the triangle's plane, camera axes [m].
//
// step : of the line of sight at depth 1. A place is its depth times its line of sight, and stays
// on the plane.
vec3 place_step(Surface s, vec3 step) {
    float off_plane = min(dot(s.facet, s.place), -1e-6 * length(s.place));
    return s.place.z * (step - s.place * (dot(s.facet, step) / off_plane));
}
#endif

// The surface that a sample sees.
Surface surface_seen(ivec2 at) {
    vec4 place = texelFetch(seen_place, at, 0), shape = texelFetch(seen_shape, at, 0);
    vec4 plane = texelFetch(seen_plane, at, 0);
    uint material = material_of(place.w);
    Surface s;
    s.body = place.xyz;
    s.place = (camera_from_body * vec4(s.body, 1.0)).xyz;
    s.wo = normalize(-s.place);
    s.facet = dot(plane.xyz, s.wo) < 0.0 ? -plane.xyz : plane.xyz;
    s.n = shape.xyz;
    s.plain_n = s.n;
    vec4 law = material_law[material];   // metallic, roughness, 1 if Lambertian, 1 if it conserves
    s.reflectance = material_reflectance[material];
    s.metallic = law.x;
    s.emission = material_emission[material];
    float roughness2 = pow(law.y, 4.0);
#ifdef DETAILED
    vec4 worn = texelFetch(worn_emission, at, 0), relief = texelFetch(worn_normal, at, 0);
    s.reflectance = texelFetch(worn_reflectance, at, 0);
    s.metallic = worn.w;
    s.emission *= worn.rgbr;
    s.n = relief.xyz;
    roughness2 = relief.w;
#endif
    s.alpha = sqrt(roughness2 + shape.w);
    s.lambertian = law.z > 0.5;
    s.coat = 0.0;
    s.coat_alpha = 1.0;
    s.gain = vec4(1.0);
    s.earth_share = plane.w;
    s.others = vec4(0.0);
#ifdef EXCHANGE
    s.others = texelFetch(seen_others, at, 0);
#endif
#ifdef LAYERED
    s.pattern = s.body;
    s.pattern_from_camera = transpose(mat3(camera_from_body));
#ifdef JOINTED
    turn_back(s, uint(place.w) % 16384u);
#endif
    vec3 dx = place_step(s, sample_steps[0].xyz), dy = place_step(s, sample_steps[1].xyz);
    vec4 layers = material_layers[material];   // of the coat: strength, roughness; of the crinkle
    s.coat = layers.x;
    s.coat_alpha = sqrt(pow(layers.y, 4.0) + shape.w);
    // Loops that run once or not at all: a CPU renderer skips a loop that no sample needs, but runs
    // both sides of every branch.
    bool cells = material_cells[material].x > 0.0, crinkle = layers.z > 0.0, conserving = law.w > 0.5;
    for (int once = 0; once < int(cells); ++once) lay_cells(s, material, dx, dy);
    for (int once = 0; once < int(crinkle); ++once) crumple(s, layers.zw, dx, dy);
    for (int once = 0; once < int(conserving); ++once)
        s.gain = scattered_again(normal_reflectance(s), viewer_cosine(s), s.alpha);
#endif
    return s;
}
