#include "common/constants.glsl"

// Metallic-roughness reflection, the model of glTF 2.0 (Appendix B): a GGX microfacet lobe (Walter et
// al. 2007) with height-correlated Smith masking (Heitz 2014) and Schlick's Fresnel (1994), over a
// Lambertian base that gets what the Fresnel term leaves.

// Normal distribution; `alpha` = roughness^2 [sr-1].
float D_ggx(float NoH, float alpha) {
    float a2 = alpha * alpha;
    float d = NoH * NoH * (a2 - 1.0) + 1.0;
    return a2 / (PI * d * d);
}

// Masking and shadowing over 4 NoL NoV. With Lambda(c) = (-1 + sqrt(1 + alpha^2 (1-c^2)/c^2)) / 2,
// G2 = 1 / (1 + Lambda(l) + Lambda(v)) and the division by c cancels.
float V_smith(float NoL, float NoV, float alpha) {
    float a2 = alpha * alpha;
    float l = NoV * sqrt(NoL * NoL * (1.0 - a2) + a2);
    float v = NoL * sqrt(NoV * NoV * (1.0 - a2) + a2);
    return 0.5 / (l + v);
}

vec4 F_schlick(vec4 f0, float VoH) {
    return f0 + (1.0 - f0) * pow(1.0 - VoH, 5.0);
}

// Bidirectional reflectance [sr-1] per band for unit normal `n` and directions `wi`, `wo` away from
// the surface, both above it; `alpha` is the lobe's width, roughness^2.
vec4 brdf(vec4 reflectance, float metallic, float alpha, vec3 n, vec3 wi, vec3 wo) {
    vec3 h = normalize(wi + wo);
    float NoL = max(dot(n, wi), 1e-6);
    // An interpolated normal can lean away from the viewer by a facet's angle.
    float NoV = max(dot(n, wo), 1e-4);
    float VoH = clamp(dot(wo, h), 0.0, 1.0);
    float lobe = D_ggx(clamp(dot(n, h), 0.0, 1.0), alpha) * V_smith(NoL, NoV, alpha);
    vec4 F = F_schlick(mix(vec4(0.04), reflectance, metallic), VoH);
    vec4 base = (1.0 - metallic) * reflectance / PI;
    return (1.0 - F) * base + F * lobe;
}
