// Radiance of a spacecraft's surface under the Sun [W m-2 sr-1].
#include "block/craft"
#include "block/materials"
#include "common/sun.glsl"
#include "surface/brdf.glsl"
#include "surface/shadow.glsl"

uniform sampler2D shadow_map;

in vec3 position;
in vec3 normal;
in vec3 light_clip;
flat in uint material;

out vec4 radiance;

// Roughness of the normals within one sample's cell, alpha^2 of a microfacet lobe. A uniform cell
// spreads the normal by (|dn/du|^2 + |dn/dv|^2) / 12 per slope, and alpha^2 is twice a slope's
// variance; a lobe so widened is the mean over the cell (after Tokuyoshi & Kaplanyan 2019, whose cap
// of 0.18 keeps silhouettes, where the expansion fails, from going dull).
float cell_roughness(vec3 n) {
    vec3 du = dFdx(n), dv = dFdy(n);
    return min((dot(du, du) + dot(dv, dv)) / 6.0, 0.18);
}

// Share of the sunlight that reaches this point past the casters in the shadow map.
//
// n, facet : interpolated and geometric normal, camera axes; wi towards the Sun
float sunlit(vec3 n, vec3 facet, vec3 wi) {
    // The Sun's centre is below the surface's own horizon: disc_cosine has cut the disc already, and
    // no map along the centre's rays can tell more. At most 0.1 % of the full sunlight is left here.
    if (dot(n, wi) <= 0.0) return 1.0;
    float texels = float(textureSize(shadow_map, 0).x);
    mat3 light_from_camera = mat3(light_from_body) * transpose(mat3(camera_from_body));
    // The smooth surface that the normals stand for lies above its facets by the sagitta of an edge;
    // a quarter of a texel lifts the receiver there. Facets that already face away use its plane.
    vec3 place = light_clip + light_from_camera * n * (0.5 * light_half_size / texels);
    vec3 plane_normal = dot(facet, wi) > 0.0 ? facet : n;
    vec2 slope = plane_slope(light_from_camera * plane_normal, texels);
    return lit_fraction(shadow_map, place, slope);
}

void main() {
    // Of the facet itself, towards the viewer; the interpolated normal bends away from it.
    vec3 facet = normalize(cross(dFdx(position), dFdy(position)));
    vec3 wo = normalize(-position);
    vec3 wi = sun_direction.xyz;
    // Both sides of an open sheet are surface: its normal turns to the viewer.
    vec3 n = normalize(gl_FrontFacing ? normal : -normal);
    float widening = cell_roughness(n);
    facet = dot(facet, wo) < 0.0 ? -facet : facet;
    radiance = vec4(0.0);
    float facing = disc_cosine(dot(n, wi), sun_angular_radius);
    if (facing <= 0.0) return;
    float lit = sunlit(n, facet, wi);
    if (lit <= 0.0) return;
    vec4 reflectance = material_reflectance[material];
    vec4 law = material_law[material];   // metallic, roughness, 1 if Lambertian
    float alpha = sqrt(pow(law.y, 4.0) + widening);
    vec4 f = law.z > 0.5 ? reflectance / PI : brdf(reflectance, law.x, alpha, n, wi, wo,
                                                           sun_angular_radius);
    radiance = f * sun_irradiance * facing * lit;
}
