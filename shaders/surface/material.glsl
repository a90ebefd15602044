#include "block/spacecraft"
#include "block/materials"
#include "surface/albedo.glsl"
#include "surface/brdf.glsl"
#include "surface/cells.glsl"
#include "surface/crinkle.glsl"

// A point of a spacecraft's surface as light meets it; camera axes.
struct Surface {
    vec3 place;          // [m]
    vec3 body;           // the same in body axes, good to float32 however far the camera is [m]
    vec3 pattern;        // where cells and crinkles have it: stored place, body axes [m]
    mat3 pattern_from_camera;   // turns into those axes
    vec3 wo;             // unit, towards the viewer
    vec3 facet;          // unit normal of the triangle, on the viewer's side
    vec3 n;              // unit normal to shade with
    vec3 plain_n;        // the same without relief: normal maps, crinkles
    vec4 reflectance;    // base colour per band
    float metallic;
    float alpha;         // width of the microfacet lobe, with the spread of the normals, in the mean over directions
    vec2 turn;           // of the normals over the cell's part, along an axis and across it [rad]
    vec3 axis;           // unit, square to plain_n
    bool lambertian;
    vec4 gain;           // of the lobe, for light that meets several microfacets
    float coat;          // share that a clear coat covers
    float coat_alpha;    // width of its lobe
    vec4 emission;       // radiance of its own [W m-2 sr-1]
    float earth_share;   // what other surfaces of the spacecraft leave of the Earth's light
    vec4 indirect;       // irradiance from them [W m-2]
    vec4 seen, coat_seen;                // of them in the lobes of base and coat [W m-2 sr-1]
    float sky_share, coat_sky_share;     // what they leave of the Earth's light in these
    float time;          // of its row (common/moving.glsl)
};

// Reflectance of clear coats at normal incidence: glass or varnish of index 1.5.
const float COAT_F0 = 0.04;

// Width of its narrowest lobe.
float narrowest_lobe(Surface s) {
    float base = s.lambertian ? 1.0 : s.alpha;
    return s.coat > 0.0 ? min(base, s.coat_alpha) : base;
}

float viewer_cosine(Surface s) {
    // An interpolated normal can lean away from the viewer by a facet's angle.
    return clamp(dot(s.n, s.wo), 1e-4, 1.0);
}

vec4 normal_reflectance(Surface s) {
    return mix(vec4(0.04), s.reflectance, s.metallic);
}

// Light that left one microfacet and met others is missing from the lobe; it is returned in the
// lobe's own shape, so that F0 = 1 reflects everything (Turquin 2019, eq. 16).
vec4 scattered_again(vec4 f0, float NoV, float alpha) {
    float once = lobe_albedo(vec4(1.0), NoV, alpha).r;
    return 1.0 + f0 * (1.0 - once) / once;
}

// Solar cells: where there is a gap or a metal line, another reflectance, and no glass in gaps.
//
// box : of the sample's footprint, along the pattern's axes [m]
void lay_cells(inout Surface s, uint material, vec3 box) {
    vec3 n = s.pattern_from_camera * s.n;
    vec3 sizes = material_cells[material].xyz;
    vec2 share = cell_shares(s.pattern, box, n, sizes, material_lines[material]);
    s.reflectance = share.x * s.reflectance + share.y * material_metal_reflectance[material]
                  + (1.0 - share.x - share.y) * material_gap_reflectance[material];
    s.coat *= share.x + share.y;
}

// A crumpled foil: the facets' own normals where they are larger than the sample's footprint.
//
// size : mean spacing of the large facets [m]
void crumple(inout Surface s, float size, Crinkle c) {
    vec3 n = transpose(s.pattern_from_camera)
           * crinkled_normal(s.pattern, s.pattern_from_camera * s.n, size, c);
    // A facet that faces away is seen edge-on.
    s.n = normalize(n + max(0.05 - dot(n, s.wo), 0.0) * s.wo);
}

// Share of the light from a direction that the relief around a point lets through. Slopes as steep
// as its own shade it where light comes in flatter than they are, all of it at the horizon of the
// surface without relief.
float past_relief(Surface s, vec3 wi) {
    float steep = length(cross(s.plain_n, s.n));
    return steep < 1e-4 ? 1.0 : clamp(dot(s.plain_n, wi) / steep, 0.0, 1.0);
}

// Share of the light that crosses the clear coat along a direction, once.
float coat_transmission(Surface s, float cosine) {
    return 1.0 - s.coat * F_schlick(vec4(COAT_F0), clamp(cosine, 0.0, 1.0)).r;
}

// Share of a uniform sky's irradiance that crosses the clear coat: the mean of Schlick's term is
// F0 + (1 - F0) / 21.
float coat_sky_transmission(Surface s) {
    return 1.0 - s.coat * (COAT_F0 + (1.0 - COAT_F0) / 21.0);
}

// Width of a lobe for light from one direction, by its mean with the spread of the normals.
//
// Shading points lie a turn w of the normals apart. Lobes with alpha^2 = w^2 besides their own have together the
// same light wherever the highlight lies between them, to 1 %; with w^2 / 3, the mean over the cell, to 15 %.
LobeWidth direct_width(Surface s, float alpha) {
    vec2 squares = s.turn * s.turn;
    vec2 alpha2 = max(alpha * alpha - (squares.x + squares.y) / 6.0, 1e-8) + squares;
    return uneven_width(alpha2.x, alpha2.y, s.axis);
}

// Bidirectional reflectance [sr-1] per band, its mean over a small disc of light.
vec4 reflection(Surface s, Disc light) {
    vec4 f = s.reflectance / PI;
    if (!s.lambertian)
        f = brdf(s.reflectance, s.metallic, direct_width(s, s.alpha), s.gain, s.n, light, s.wo);
    if (s.coat > 0.0) {
        f *= coat_transmission(s, dot(s.n, light.wi)) * coat_transmission(s, viewer_cosine(s));
        f += s.coat * coat_brdf(COAT_F0, direct_width(s, s.coat_alpha), s.n, light, s.wo);
    }
    return f;
}

// Share of a uniform irradiance that leaves diffusely towards the viewer: the radiance is this
// times E / PI.
vec4 diffuse_albedo(Surface s) {
    vec4 share = s.reflectance;
    float NoV = viewer_cosine(s);
    if (!s.lambertian)
        share *= (1.0 - s.metallic) * (1.0 - normal_reflectance(s)) * base_share(NoV);
    if (s.coat > 0.0) share *= coat_sky_transmission(s) * coat_transmission(s, NoV);
    return share;
}

// Directional albedo of the base's specular lobe, of width s.alpha: the radiance is this times the
// radiance that the lobe sees.
//
// split : scale and bias of the lobe
vec4 glossy_albedo(Surface s, vec2 split) {
    if (s.lambertian) return vec4(0.0);
    float NoV = viewer_cosine(s);
    vec4 share = s.gain * (normal_reflectance(s) * split.x + split.y);
    if (s.coat > 0.0) {
        // A narrow lobe sees what lies at the viewer's own incidence, a wide one much of the sky.
        float out_transmission = coat_transmission(s, NoV);
        float wide = s.alpha / (s.alpha + NoV);
        share *= mix(out_transmission, coat_sky_transmission(s), wide) * out_transmission;
    }
    return share;
}

// What a surface turns to the viewer of light from all around, lobe by lobe; of the clear coat grey. And the
// round lobes of base and coat that see it, as of_lobe has them.
struct Albedo {
    vec4 diffuse, glossy;
    float coat;
    vec2 seen, coat_seen;
};

Albedo albedo_of(Surface s) {
    float NoV = viewer_cosine(s);
    vec4 base = of_lobe(NoV, s.alpha), coat = vec4(0.0);
    if (s.coat > 0.0) coat = of_lobe(NoV, s.coat_alpha);
    return Albedo(diffuse_albedo(s), glossy_albedo(s, base.xy), s.coat * (COAT_F0 * coat.x + coat.y),
                  base.zw, coat.zw);
}
