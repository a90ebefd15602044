#include "common/constants.glsl"

// Metallic-roughness reflection, the model of glTF 2.0 (Appendix B): a GGX microfacet lobe (Walter et
// al. 2007) with height-correlated Smith masking (Heitz 2014) and Schlick's Fresnel (1994), over a
// Lambertian base that gets what the Fresnel term leaves.

// A small disc of light.
struct Disc {
    vec3 wi;        // unit, towards its centre
    float radius;   // angular [rad]
    vec4 limb_u;    // darkening towards its limb per band, the law of limb_profile (physics/solar_disc.py);
    vec4 limb_v;    // zeros where it is uniform
};

// Width of a microfacet lobe, which may be longer in one direction: its slopes go with
// s^2 / alpha^2, where s is divided by the stretch along an axis and multiplied by it across.
struct LobeWidth {
    float alpha;
    float stretch;
    vec3 axis;      // unit, square to the normal; as long as it has to be where the stretch is 1
};

LobeWidth round_width(float alpha) {
    return LobeWidth(alpha, 1.0, vec3(1.0, 0.0, 0.0));
}

// From alpha^2 along an axis and across it.
LobeWidth uneven_width(float along2, float across2, vec3 axis) {
    return LobeWidth(sqrt(sqrt(along2 * across2)), sqrt(sqrt(along2 / across2)), axis);
}

// The image of a disc of light among a surface's microfacets, in slopes (tangents of angles from the
// normal) in which the lobe is round: an ellipse around the half vector of the disc's centre.
struct DiscImage {
    float slope2;        // of its centre, squared
    float tangential;    // its matrix, in the direction of the slope and square to it: semi-axes
    float mixed2;        // squared in the principal axes; the mixed element squared
    float trace, det;
    float u;             // confocal coordinate
    float per_angle;     // square of angles per square of slopes, of the lobe as it is
};

// Half vectors turn half as much as the light in the plane of light and viewer, and 1 / VoH times that
// across it. Slopes stretch by 1 / NoH^2 along themselves and by 1 / NoH across.
//
// The ellipsoid confocal with the ellipse, through the point a height alpha above the lobe's centre:
// with M the ellipse's matrix and c its centre, u solves c (M + u)^-1 c + alpha^2 / u = 1. The root
// for a circle that reaches as far towards the lobe is exact far outside of the ellipse and deep
// within; three Newton steps on u (1 - sum), nearly a line, leave 1e-6, and 1e-3 at the rim of a mirror
// image.
DiscImage disc_image(vec3 n, vec3 h, vec3 wo, float VoH, LobeWidth lobe, float radius) {
    float NoH = max(dot(n, h), 1e-4);
    // The slope as a vector square to h, from a sine: that keeps its digits where the cosine loses
    // them.
    vec3 slope = cross(cross(h, n), h) / NoH;
    // A normal that leans past the half vectors' horizon is as far from them as one upon it.
    if (dot(n, h) < NoH) slope = normalize(slope + vec3(1e-6)) / NoH;
    vec3 side = cross(wo, h);
    float slope2 = dot(slope, slope), across = dot(slope, side), along = dot(slope, cross(side, h));
    float y2 = min(across * across / max(dot(side, side) * slope2, 1e-30), 1.0), x2 = 1.0 - y2;
    // Towards the horizon of the half vectors the slopes of a disc would have no end: where the lobe is
    // flat, a smaller disc does.
    radius = min(radius, 0.3 * NoH * VoH);
    float narrow = 0.25 * radius * radius, wide = narrow / (VoH * VoH), stretch2 = 1.0 / (NoH * NoH);
    // The ellipse's matrix: in the direction of the slope, square to it, mixed.
    float radial = (narrow * x2 + wide * y2) * stretch2 * stretch2;
    float tangential = (narrow * y2 + wide * x2) * stretch2;
    float mixed = sign(along * across) * sqrt(x2 * y2) * (wide - narrow) * stretch2 / NoH;
    // To slopes in which the lobe is round: what becomes of both directions.
    vec2 to_axis = vec2(dot(h, lobe.axis), dot(h, cross(n, lobe.axis)));
    to_axis = dot(to_axis, to_axis) > 1e-12 ? normalize(to_axis) : vec2(1.0, 0.0);
    vec2 scale = vec2(1.0 / lobe.stretch, lobe.stretch), part = to_axis * to_axis;
    vec2 to_radial = vec2(dot(scale, part), (scale.y - scale.x) * to_axis.x * to_axis.y);
    vec2 to_tangential = vec2(to_radial.y, dot(scale, part.yx));
    float longer2 = dot(to_radial, to_radial);
    vec2 d = to_radial * inversesqrt(longer2), e = vec2(-d.y, d.x);
    vec2 of_d = vec2(dot(to_radial, d), dot(to_tangential, d)), of_e = vec2(dot(to_radial, e), dot(to_tangential, e));
    vec2 M_of_e = vec2(radial * of_e.x + mixed * of_e.y, mixed * of_e.x + tangential * of_e.y);
    DiscImage image;
    image.slope2 = slope2 * longer2;
    image.tangential = dot(of_e, M_of_e);
    image.mixed2 = dot(of_d, M_of_e) * dot(of_d, M_of_e);
    image.trace = image.tangential + radial * of_d.x * of_d.x + 2.0 * mixed * of_d.x * of_d.y
                + tangential * of_d.y * of_d.y;
    image.det = narrow * wide * stretch2 * stretch2 * stretch2;
    image.per_angle = (1.0 + slope2) * (1.0 + slope2);
    float alpha = lobe.alpha;
    float a2 = alpha * alpha, reach2 = image.det / image.tangential;
    float inside = reach2 - image.slope2 - a2;
    float S = sqrt(inside * inside + 4.0 * a2 * reach2);
    float u = inside > 0.0 ? 2.0 * a2 * reach2 / (S + inside) : 0.5 * (S - inside);
    for (int i = 0; i < 3; ++i) {
        float det = u * (u + image.trace) + image.det, t = image.tangential + u;
        float left = 1.0 - image.slope2 * t / det - a2 / u;
        float fall = image.slope2 * u * (t * t + image.mixed2) / (det * det) + a2 / u;
        // Neither term of the sum is more than 1.
        u = clamp(u - u * left / (left + fall), a2, image.slope2 + a2);
    }
    image.u = u;
    return image;
}

// Normal distribution for a light that is a small uniform disc: the mean of the GGX distribution over
// the half vectors that the disc spans [sr-1].
//
// In slopes s, GGX is (1 + s^2)^2 alpha^2 / (pi (s^2 + alpha^2)^2). As a function of its centre and
// alpha the last factor is the Poisson kernel of hyperbolic space, or a clamped cosine about a point
// alpha above the plane (Heitz & Hill 2017): its integral over an ellipse is a form factor, closed in
// the confocal coordinate. A smooth surface gets the mirror image of the disc out of it, a rough one
// the plain distribution.
float D_ggx_disc(DiscImage image, float alpha) {
    float a2 = alpha * alpha, u = image.u, t = image.tangential + u;
    float det = u * (u + image.trace) + image.det;
    float mean = a2 / (PI * sqrt(det)
                       * (a2 + image.slope2 * u * u * (t * t + image.mixed2) / (det * det)));
    return image.per_angle * mean;
}

// Radiance of a disc with a darkened limb over that of a uniform one, as a lobe sees it, per band.
//
// The lobe's means of mu = sqrt(1 - r^2) and of mu^2 over the disc are, as the potentials of Ferrers'
// ellipsoids, integrals over x = 1 / s from 0 to 1 / u of x / sqrt(det(1 + M x)), for mu divided by
// 2 sqrt(1 - c (M + s)^-1 c - alpha^2 / s), times alpha^2 / pi. Three points of Gauss's rule, spaced
// by the logarithm and by the root at 1 / u, leave 0.1 % of the darkened radiance.
vec4 limb_seen(DiscImage image, float alpha, vec4 limb_u, vec4 limb_v) {
    const vec3 at = vec3(0.112701665, 0.5, 0.887298335), weight = vec3(5.0, 8.0, 5.0) / 18.0;
    float a2 = alpha * alpha, X = 1.0 / image.u, k = 0.3 * sqrt(image.det);
    float span = log(1.0 + k * X);
    vec3 grown = exp(span * (1.0 - at * at));
    vec3 x = (grown - 1.0) / k;
    vec3 det = 1.0 + x * (image.trace + x * image.det);
    vec3 outside = 1.0 - x * (a2 + image.slope2 * (1.0 + image.tangential * x) / det);
    vec3 element = 2.0 * span * weight * at * grown * x * inversesqrt(det) / k;
    float uniform_disc = D_ggx_disc(image, alpha) / image.per_angle;
    float mu = 0.5 * a2 / PI * dot(element, inversesqrt(max(outside, 1e-6))) / uniform_disc;
    float mu2 = a2 / PI * (element.x + element.y + element.z) / uniform_disc;
    // Far from the lobe's centre float32 loses what is left of both.
    mu = clamp(mu, 0.0, 1.0);
    mu2 = clamp(mu2, mu * mu, mu);
    return (1.0 - limb_u * (1.0 - mu) - limb_v * (1.0 - 2.0 * mu + mu2))
         / (1.0 - limb_u / 3.0 - limb_v / 6.0);
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

// The microfacet lobe without its Fresnel term [sr-1], its mean over a small disc of light, per band.
//
// n : unit normal; wo : unit, away from the surface, above it
// h : unit, half way between wo and the disc's centre; VoH : cosine between wo and h
// width : roughness^2
vec4 lobe(LobeWidth width, vec3 n, Disc light, vec3 wo, vec3 h, float VoH) {
    float NoL = max(dot(n, light.wi), 1e-6);
    // An interpolated normal can lean away from the viewer by a facet's angle.
    float NoV = max(dot(n, wo), 1e-4);
    float alpha = width.alpha;
    DiscImage image = disc_image(n, h, wo, VoH, width, light.radius);
    float reflected = D_ggx_disc(image, alpha) * V_smith(NoL, NoV, alpha);
    // No mirror shows the disc brighter than it is. Where an interpolated normal has the surface
    // edge-on to the viewer and the triangle is not, the lobe alone would, without limit.
    // A disc half below the horizon lights a surface as much as under a cosine of 4 / (3 pi) radius.
    float r = light.radius;
    vec4 result = vec4(min(reflected, 1.0 / (PI * r * r * length(vec2(NoL, 0.424 * r)))));
    // Seven widths of the disc's image away its darkening is less than 1e-3 of what is left.
    if (light.limb_u.g + light.limb_v.g > 0.0 && image.trace > 0.02 * image.u)
        result *= limb_seen(image, alpha, light.limb_u, light.limb_v);
    return result;
}

// Bidirectional reflectance [sr-1] per band, its mean over a small disc of light; arguments as for
// the lobe. `gain` makes up for light that meets several microfacets; 1 is the model of glTF.
vec4 brdf(vec4 reflectance, float metallic, LobeWidth width, vec4 gain, vec3 n, Disc light, vec3 wo) {
    vec3 h = normalize(light.wi + wo);
    float VoH = clamp(dot(wo, h), 1e-4, 1.0);
    vec4 F = F_schlick(mix(vec4(0.04), reflectance, metallic), VoH);
    vec4 base = (1.0 - metallic) * reflectance / PI;
    return (1.0 - F) * base + F * gain * lobe(width, n, light, wo, h, VoH);
}

// The same of a round lobe without gain, for a uniform disc towards wi.
vec4 brdf(vec4 reflectance, float metallic, float alpha, vec3 n, vec3 wi, vec3 wo, float radius) {
    Disc light = Disc(wi, radius, vec4(0.0), vec4(0.0));
    return brdf(reflectance, metallic, round_width(alpha), vec4(1.0), n, light, wo);
}

// Reflectance of a clear dielectric layer alone [sr-1], `f0` its reflectance at normal incidence.
vec4 coat_brdf(float f0, LobeWidth width, vec3 n, Disc light, vec3 wo) {
    vec3 h = normalize(light.wi + wo);
    float VoH = clamp(dot(wo, h), 1e-4, 1.0);
    return F_schlick(vec4(f0), VoH).r * lobe(width, n, light, wo, h, VoH);
}
