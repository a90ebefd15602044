// The air before the camera, and the light that comes down through it: what drawing shaders read.
//
//   AirRay ray = air_ray(direction, b, d, on_ground)     once a pixel, by planet.frag
//   ray.light           scattered into the ray between camera and ground, or camera and space
//   ray.to_ground       transmittance of the air before the ground
//   ray.to_space        transmittance to what lies behind the air: Sun, Moon, stars
//                       radiance = mix(space * to_space, ground * to_ground, on_ground) + light
//   AirRay air_before(ray, height)   the same ray, cut where it meets a layer at a height [km] above
//                       the ground: what stands before a cloud. Its light and to_ground are those
//                       between camera and layer; one more table read (two inside the air).
//                       Transmittance is exact, light is shared out like extinction
//   Daylight air_daylight(mu_sun), air_daylight_at(height, mu_sun)    in air/daylight.glsl: what
//                       shines on the ground, and above it
//
// A cloud of opacity a over the ground: let over = air_before(ray, height), then the pixel has
//   (1 - a) (ground * ray.to_ground + ray.light) + a (cloud * over.to_ground + over.light).
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
    float mu_camera;   // cosine of the ray from the zenith, at the camera
    float mu_ground;   // from the zenith of the place where it meets the ground, back up
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
    AirRay ray;
    vec3 sideways = cross(direction, camera_up.xyz);
    float sine = length(sideways);
    float cos_azimuth = dot(direction, sun_side.xyz) / max(sine, 1e-9);
    float column = sqrt(clamp(0.5 - 0.5 * cos_azimuth, 0.0, 1.0));
    // On the ground, d is the squared cosine of the ray from the zenith.
    float squared = clamp(d, 0.0, 1.0);
    ray.mu_ground = sqrt(squared);
    ray.mu_camera = b * camera_nearness;
    float ground = (1.0 - row_of_cosine(ray.mu_ground, sqrt(1.0 - squared))) * (GROUND_ROWS - 1.0);
    float limb = GROUND_ROWS + row_of_limb(clamp(-d / horizon_reach, 0.0, 1.0)) * (LIMB_ROWS - 1.0);
    // Between the last row of the ground and the first of the limb, the filter mixes them by share.
    bool seen = on_ground > 0.0 && d > 0.0;
#ifdef AIR_INSIDE
    float up = row_of_cosine(max(ray.mu_camera, 0.0), sine) * (SKY_ROWS - 1.0);
    limb = b < 0.0 ? limb : GROUND_ROWS + LIMB_ROWS + up;
    vec2 place = view_place(column, seen ? ground + 1.0 - on_ground : limb - on_ground);
    ray.light = view_light_at(place) * earth_sun_irradiance;
    ray.to_ground = view_transmittance_at(view_place(column, seen ? ground : GROUND_ROWS - 1.0));
    ray.to_space = view_transmittance_at(view_place(column, seen ? GROUND_ROWS : limb));
#else
    vec2 place = view_place(column, seen ? ground + 1.0 - on_ground : limb - on_ground);
    float in_air = b < 0.0 && d > -horizon_reach ? 1.0 : 0.0;
    ray.light = view_light_at(place) * earth_sun_irradiance * in_air;
    ray.to_ground = ray.to_space = mix(vec4(1.0), view_transmittance_at(place), in_air);
#endif
    return ray;
}

// Cosine from the zenith at a height, of a line that has `mu` at another height [km].
float mu_at(float height, float mu, float from_height) {
    float nearer = (ground_radius + from_height) / (ground_radius + height);
    return sqrt(max(1.0 - (1.0 - mu * mu) * nearer * nearer, 0.0));
}

#ifndef AIR_INSIDE
// As below, at a height where the ray comes down at a cosine `mu` from the zenith.
AirRay air_before_at(AirRay ray, float height, float mu) {
    AirRay cut = ray;
    cut.to_ground = transmittance_to_space(height, mu);
    cut.light = ray.light * min((1.0 - cut.to_ground) / max(1.0 - ray.to_ground, 1e-6), 1.0);
    return cut;
}
#endif

AirRay air_before(AirRay ray, float height) {
#ifndef AIR_INSIDE
    return air_before_at(ray, height, mu_at(height, ray.mu_ground, 0.0));
#else
    AirRay cut = ray;
    bool below = ray.mu_camera > 0.0;
    float mu = below ? mu_at(height, ray.mu_camera, camera_height) : mu_at(height, ray.mu_ground, 0.0);
    vec4 beyond = transmittance_to_space(height, mu);
    vec4 here = transmittance_to_space(camera_height, abs(ray.mu_camera));
    cut.to_ground = min(below ? here / max(beyond, 1e-9) : beyond / max(here, 1e-9), 1.0);
    vec4 full = below ? ray.to_space : ray.to_ground;
    cut.light = ray.light * min((1.0 - cut.to_ground) / max(1.0 - full, 1e-6), 1.0);
    return cut;
#endif
}
