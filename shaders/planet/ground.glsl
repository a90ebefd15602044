// The ground: what it reflects of the light that reaches it [W m-2 sr-1].
#include "block/planet"
#include "common/sun.glsl"
#include "air/daylight.glsl"

uniform sampler2D day_map_rgb;   // sqrt of the reflectance, 0..1
uniform sampler2D day_map_nir;

// Reflectance at geodetic latitude and longitude [rad]; `footprint` of the pixel [rad of latitude].
vec4 ground_reflectance(float latitude, float longitude, float footprint) {
    if (albedo_from_map < 0.5) return earth_albedo;
    vec2 place = vec2(longitude / (2.0 * PI) + 0.5, 0.5 - latitude / PI);
    float texels = footprint / PI * float(textureSize(day_map_rgb, 0).y);
    float level = log2(max(texels, 1e-6));
    vec4 root = vec4(textureLod(day_map_rgb, place, level).rgb,
                     textureLod(day_map_nir, place, level).r);
    return root * root;
}

// Radiance towards the camera from a place on the ellipsoid.
//
// normal    : of the ellipsoid, ITRF
// footprint : of the pixel [rad of latitude]
vec4 ground_radiance(vec3 normal, float footprint) {
    float cosine = dot(normal, sun_direction_itrf.xyz);
    vec4 rho = ground_reflectance(asin(clamp(normal.z, -1.0, 1.0)), atan(normal.y, normal.x),
                                  footprint);
    Daylight light = air_daylight(cosine);
    return rho / PI * (light.direct * disc_cosine(cosine, sun_angular_radius) + light.diffuse);
}
