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

void main() {
    // Of the facet itself; the interpolated normal bends away from it.
    vec3 facet = cross(dFdx(position), dFdy(position));
    vec3 wo = normalize(-position);
    vec3 wi = sun_direction.xyz;
    // Both sides of an open sheet are surface: its normal turns to the viewer.
    vec3 n = normalize(gl_FrontFacing ? normal : -normal);
    radiance = vec4(0.0);
    float facing = disc_cosine(dot(n, wi), sun_angular_radius);
    if (facing <= 0.0) return;
    float texels = float(textureSize(shadow_map, 0).x);
    vec3 facet_clip = mat3(light_from_body) * (facet * mat3(camera_from_body)) * light_unscale.xyz;
    vec2 slope = plane_slope(facet_clip, texels);
    float lit = lit_fraction(shadow_map, light_clip, slope, light_unscale.w / texels);
    if (lit <= 0.0) return;
    vec4 reflectance = material_reflectance[material];
    vec4 law = material_law[material];   // metallic, roughness, 1 if Lambertian
    vec4 f = law.z > 0.5 ? reflectance / PI : brdf(reflectance, law.x, law.y, n, wi, wo);
    radiance = f * sun_irradiance * facing * lit;
}
