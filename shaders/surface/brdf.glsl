#include "common/constants.glsl"

// Metallic-roughness reflection, the model of glTF 2.0 (Appendix B): a GGX microfacet lobe (Walter et
// al. 2007) with height-correlated Smith masking (Heitz 2014) and Schlick's Fresnel (1994), over a
// Lambertian base that gets what the Fresnel term leaves.

// Normal distribution for a light that is a small uniform disc: the mean of the GGX distribution over
// the half vectors that the disc spans [sr-1].
//
// n, h : unit normal and half vector of the disc's centre; VoH between viewer and half vector
// alpha : roughness^2; radius : angular, of the disc [rad]
//
// In slopes (s = tan of the angle between n and h) GGX is (1 + s^2)^2 alpha^2 / (pi (s^2 + alpha^2)^2),
// and the disc covers a slope area pi rho^2 with rho^2 = radius^2 / (4 VoH NoH^3): half vectors turn
// half as much as the light, and slopes stretch. The integral of alpha^2 / (pi (|s - t|^2 + alpha^2)^2)
// over a disc of radius rho is (1 + (rho^2 - s^2 - alpha^2) / S) / 2 with
// S^2 = (s^2 + rho^2 + alpha^2)^2 - 4 s^2 rho^2, as the potential of such a disc. A smooth surface gets
// the mirror image of the disc out of it, a rough one the plain distribution.
//
// Across the plane of light and viewer, half vectors turn 1 / VoH as much again: the disc's image is
// an ellipse. Near it both components of s are scaled to a circle by the widths that lobe and ellipse
// have together, exact where one of them dominates; far from it its shape no longer matters.
float D_ggx_disc(vec3 n, vec3 h, vec3 wo, float VoH, float alpha, float radius) {
    float NoH = max(dot(n, h), 1e-4);
    // The slope as a vector square to h, from a sine: that keeps its digits where the cosine loses
    // them.
    vec3 slope = cross(cross(h, n), h) / NoH;
    vec3 side = cross(wo, h);
    float across = dot(slope, side) / max(length(side), 1e-6);
    float total = dot(slope, slope);
    float a2 = alpha * alpha;
    float rho2 = radius * radius / (4.0 * VoH * NoH * NoH * NoH);
    float w2 = a2 + rho2;
    float round_s2 = across * across * w2 / (a2 + rho2 / VoH)
                   + max(total - across * across, 0.0) * w2 / (a2 + rho2 * VoH);
    float distance2 = total / (4.0 * w2);
    float s2 = mix(total, round_s2, 1.0 / (1.0 + distance2 * distance2));
    float u = s2 + a2;
    float S = sqrt((u + rho2) * (u + rho2) - 4.0 * s2 * rho2);
    // Two forms of one expression, each without cancellation on its side.
    float mean = u > rho2 ? 2.0 * a2 / (PI * S * (S + u - rho2))
                          : (S + rho2 - u) / (2.0 * PI * rho2 * S);
    return (1.0 + total) * (1.0 + total) * mean;
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

// The microfacet lobe without its Fresnel term [sr-1], its mean over a small disc of light.
//
// n : unit normal; wi (the disc's centre), wo : unit, away from the surface, above it
// h : unit, half way between them; VoH : cosine between wo and h
// alpha : the lobe's width, roughness^2; radius : angular, of the disc [rad]
float lobe(float alpha, vec3 n, vec3 wi, vec3 wo, vec3 h, float VoH, float radius) {
    float NoL = max(dot(n, wi), 1e-6);
    // An interpolated normal can lean away from the viewer by a facet's angle.
    float NoV = max(dot(n, wo), 1e-4);
    float reflected = D_ggx_disc(n, h, wo, VoH, alpha, radius) * V_smith(NoL, NoV, alpha);
    // No mirror shows the disc brighter than it is. Where an interpolated normal has the surface
    // edge-on to the viewer and the triangle is not, the lobe alone would, without limit.
    // A disc half below the horizon lights a surface as much as under a cosine of 4 / (3 pi) radius.
    return min(reflected, 1.0 / (PI * radius * radius * length(vec2(NoL, 0.424 * radius))));
}

// Bidirectional reflectance [sr-1] per band, its mean over a small disc of light; arguments as for
// the lobe. `gain` makes up for light that meets several microfacets; 1 is the model of glTF.
vec4 brdf(vec4 reflectance, float metallic, float alpha, vec4 gain, vec3 n, vec3 wi, vec3 wo,
          float radius) {
    vec3 h = normalize(wi + wo);
    float VoH = clamp(dot(wo, h), 1e-4, 1.0);
    vec4 F = F_schlick(mix(vec4(0.04), reflectance, metallic), VoH);
    vec4 base = (1.0 - metallic) * reflectance / PI;
    return (1.0 - F) * base + F * gain * lobe(alpha, n, wi, wo, h, VoH, radius);
}

vec4 brdf(vec4 reflectance, float metallic, float alpha, vec3 n, vec3 wi, vec3 wo, float radius) {
    return brdf(reflectance, metallic, alpha, vec4(1.0), n, wi, wo, radius);
}

// Reflectance of a clear dielectric layer alone [sr-1], `f0` its reflectance at normal incidence.
float coat_brdf(float f0, float alpha, vec3 n, vec3 wi, vec3 wo, float radius) {
    vec3 h = normalize(wi + wo);
    float VoH = clamp(dot(wo, h), 1e-4, 1.0);
    return F_schlick(vec4(f0), VoH).r * lobe(alpha, n, wi, wo, h, VoH, radius);
}
