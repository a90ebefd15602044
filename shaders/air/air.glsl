// The air before the camera, and the light that comes down through it: what drawing shaders read.
//
//   AirRay ray = air_ray(direction, b, d, on_ground)     once a pixel
//   ray.light           scattered into the ray between camera and ground, or camera and space
//   ray.to_ground       transmittance of the air before the ground
//   ray.to_space        transmittance to what lies behind the air: Sun, Moon, stars
//                       radiance = mix(space * to_space, ground * to_ground, on_ground) + light
//   air_before(ray, height)   the same ray, cut where it meets a layer at a height above the ground,
//                       for clouds: two more reads; seen from below the layer it is not cut
//   air_daylight(mu_sun), air_daylight_at(height, mu_sun)   in air/daylight.glsl: what shines there
//
// Radiances are [W m-2 sr-1], for the sunlight of the block Planet. Everything is measured in the
// space where the ellipsoid is the unit sphere: straight lines, horizon and terminator are exact in
// it; heights above the ellipsoid stretch by up to 0.34 % at the poles, and the Sun's angles shift by
// as little.
#include "block/planet"
#include "air/transmittance.glsl"
#include "air/view.glsl"

uniform sampler2D view_light;
uniform sampler2D view_transmittance;

struct AirRay {
    vec4 light;
    vec4 to_ground;
    vec4 to_space;
    float mu_ground;   // cosine of the ray from the zenith, where it meets the ground
};

vec2 view_place(float column, float row) {
    vec2 size = vec2(textureSize(view_light, 0));
    return vec2(table_place(column, size.x), (row + 0.5) / size.y);
}

// The tables hold the fourth and the eighth root.
vec4 view_light_at(vec2 place) {
    vec4 root = textureLod(view_light, place, 0.0);
    root *= root;
    return root * root;
}

vec4 view_transmittance_at(vec2 place) {
    vec4 root = textureLod(view_transmittance, place, 0.0);
    root *= root;
    root *= root;
    return root * root;
}

// direction : unit, in sphere space
// b, d      : product of camera place and direction, and b^2 - (|camera|^2 - 1)
// on_ground : share of the pixel that lies on the ground
AirRay air_ray(vec3 direction, float b, float d, float on_ground) {
    vec3 sideways = cross(direction, camera_up.xyz);
    float sine = length(sideways);
    float cos_azimuth = dot(direction, sun_side.xyz) / max(sine, 1e-9);
    float column = sqrt(clamp(0.5 - 0.5 * cos_azimuth, 0.0, 1.0));
    // On the ground, d is the squared cosine of the ray from the zenith.
    float mu_ground = sqrt(clamp(d, 0.0, 1.0));
    float ground = (1.0 - row_of_cosine(mu_ground, sqrt(1.0 - mu_ground * mu_ground)))
                 * (GROUND_ROWS - 1.0);
    float limb = GROUND_ROWS + row_of_limb(clamp(-d / horizon_reach, 0.0, 1.0)) * (LIMB_ROWS - 1.0);
#ifdef AIR_INSIDE
    float mu = max(b, 0.0) * camera_nearness;
    float up = GROUND_ROWS + LIMB_ROWS + row_of_cosine(mu, sine) * (SKY_ROWS - 1.0);
    limb = b < 0.0 ? limb : up;
    bool air = true;
#else
    bool air = b < 0.0 && d > -horizon_reach;
#endif
    // Between the last row of the ground and the first of the limb, the filter mixes them by share.
    bool seen = on_ground > 0.0 && d > 0.0;
    float row = seen ? ground + 1.0 - on_ground : limb - on_ground;
    AirRay ray;
    ray.mu_ground = mu_ground;
    ray.light = air ? view_light_at(view_place(column, row)) * earth_sun_irradiance : vec4(0.0);
#ifdef AIR_INSIDE
    ray.to_ground = view_transmittance_at(view_place(column, seen ? ground : GROUND_ROWS - 1.0));
    ray.to_space = view_transmittance_at(view_place(column, seen ? GROUND_ROWS : limb));
#else
    ray.to_ground = ray.to_space = air ? view_transmittance_at(view_place(column, row)) : vec4(1.0);
#endif
    return ray;
}
