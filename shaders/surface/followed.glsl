#include "surface/material.glsl"

// How far rays decide what a lobe sees of its own spacecraft, 0..1: where it gives little of what leaves
// towards the viewer, as on white paint seen from before, they would cost much for little.
float followed_share(vec4 lobe, vec4 rest) {
    const vec4 mean = vec4(0.25);
    return smoothstep(0.05, 0.12, dot(mean, lobe) / dot(mean, lobe + rest));
}

float base_followed(Surface s) {
    if (s.lambertian) return 0.0;
    vec4 lobe = F_schlick(normal_reflectance(s), viewer_cosine(s));
    return followed_share(lobe, (1.0 - s.metallic) * s.reflectance);
}

float coat_followed(Surface s) {
    if (s.coat <= 0.0) return 0.0;
    return followed_share(s.coat * F_schlick(vec4(COAT_F0), viewer_cosine(s)), s.reflectance);
}
