#include "block/craft"
#include "common/sun.glsl"
#include "surface/material.glsl"
#include "surface/shadow.glsl"

uniform sampler2D shadow_map;

// Share of the sunlight that reaches a surface past the casters in the shadow map.
//
// clip : the surface's place in the map's clip space
float sunlit(Surface s, vec3 clip) {
    vec3 wi = sun_direction.xyz;
    // The Sun's centre is below the surface's own horizon: disc_cosine has cut the disc already, and
    // no map along the centre's rays can tell more. At most 0.1 % of the full sunlight is left here.
    if (dot(s.n, wi) <= 0.0) return 1.0;
    float texels = float(textureSize(shadow_map, 0).x);
    mat3 light_from_camera = mat3(light_from_body) * transpose(mat3(camera_from_body));
    // The smooth surface that the normals stand for lies above its facets by the sagitta of an edge;
    // a quarter of a texel lifts the receiver there. Facets that already face away use its plane.
    vec3 place = clip + light_from_camera * s.n * (0.5 * light_half_size / texels);
    vec3 plane_normal = dot(s.facet, wi) > 0.0 ? s.facet : s.n;
    vec2 slope = plane_slope(light_from_camera * plane_normal, texels);
    return lit_fraction(shadow_map, place, slope);
}

// Radiance of the sunlight that a surface turns to the viewer [W m-2 sr-1].
vec4 sun_light(Surface s, vec3 clip) {
    float facing = disc_cosine(dot(s.n, sun_direction.xyz), sun_angular_radius);
    if (facing <= 0.0) return vec4(0.0);
    float lit = sunlit(s, clip);
    if (lit <= 0.0) return vec4(0.0);
    return reflection(s, sun_direction.xyz, sun_angular_radius) * sun_irradiance * facing * lit;
}
