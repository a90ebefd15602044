// What land, sea and clouds send up of the light that reaches them [W m-2 sr-1].
#include "block/planet"
#include "planet/cloud.glsl"
#include "planet/noise.glsl"
#include "planet/ocean.glsl"
#include "planet/place.glsl"

uniform sampler2D land_map;   // square roots of reflectance R, G, B, N
uniform sampler2D form_map;   // slopes to the east and north, shore, night lights
uniform sampler2D weather_map;   // share of cloud, thickness code, thin high cloud, raggedness

// Waves in the volume of noise are a quarter to a thirty-second of this long [km].
const float NOISE_TILE_KM = 40.0;
// Steps of the maps' codes, as in simgl/generate/earth_maps.py.
const float ROOT_SLOPE_STEP = 255.0 / 120.0;
const float SHORE_KM = 255.0 / 6.0;
const vec3 ZERO_CODE = vec3(128.0 / 255.0);
// Noise slopes are kept over +-4 of their rms.
const float NOISE_SLOPE = 8.0;
// Mean of max(1 - 3 |g|, 0) for a normal g: 2 phi(0) (1/3 - 1/6) to first order.
const float BED_MEAN = 0.131;

// How much of the noise a pixel resolves: 1 up to a texel of the volume, 0 from sixteen on, half its
// longest waves.
float resolved(float footprint_km) {
    return clamp(1.0 - 0.25 * log2(max(footprint_km, 1e-6) * 128.0 / NOISE_TILE_KM), 0.0, 1.0);
}

// Radiance at the camera from a place on the ellipsoid and the clouds above it, on top of all that
// the air scatters before the ground: what clouds hide of that is taken off.
vec4 ground_radiance(Place here) {
    vec3 normal = here.normal, view = here.view, sun = sun_direction_itrf.xyz;
    float footprint = here.footprint, lit = here.lit, mu_sun = dot(normal, sun);
    vec4 direct = here.direct, diffuse = here.diffuse;
#ifndef EARTH_MAPS
    return earth_albedo / PI * (direct * lit + diffuse);
#else
    // Noise below the maps' resolution, as far as the pixel resolves it.
    float footprint_km = footprint * planet_km;
    float detail = resolved(footprint_km);
    vec3 in_noise = noise_place(normal * planet_km, NOISE_TILE_KM);
    vec4 noise = textureLod(noise_volume, in_noise, 0.0);
    vec3 hills = detail * NOISE_SLOPE * (noise.xyz - 0.5) * NOISE_FROM_ITRF;
    float grain = dot(hills, normal);

    float across = max(length(normal.xy), 1e-4);
    vec3 east = vec3(-normal.y, normal.x, 0.0) / across, north = cross(normal, east);
    vec2 place = here.on_map;
    float level = log2(max(footprint / PI * float(textureSize(land_map, 0).y), 1e-6));
    // The noise frays what lies between two texels of the maps.
    vec2 kilometre = vec2(0.5 / across, 1.0) / (planet_km * PI);
    vec2 fray = kilometre * vec2(dot(hills, north), dot(hills, east));
    vec4 form = textureLod(form_map, place + fray, level);
    vec4 land = textureLod(land_map, place + fray, level);
    vec4 weather = textureLod(weather_map, place + 2.0 * fray, level);

    // Relief: slopes of the map, and hills that are the steeper the more rugged the map.
    vec2 root = (form.xy - ZERO_CODE.xy) * ROOT_SLOPE_STEP;
    vec2 slope = root * abs(root);
    float rugged = min(0.01 + 4.0 * length(slope), 0.35);
    vec3 tilt = slope.x * east + slope.y * north + rugged * (hills - grain * normal);
    float steepness = inversesqrt(1.0 + dot(tilt, tilt));
    // No finer at the terminator than hills are rough.
    float lit_land = max((mu_sun - dot(tilt, sun)) * steepness, 0.0);
    // Ground and growth change from hill to hill, growth most where there is some.
    land *= land;
    float growth = clamp(4.0 * (land.a - 1.2 * land.r), 0.0, 1.0);
    // Valleys and dry beds run where a slope turns; their mean darkness is taken off.
    float bed = max(1.0 - 3.0 * NOISE_SLOPE * abs(noise.x - 0.5), 0.0) - BED_MEAN;
    land *= 1.0 - 0.22 * detail * bed + grain * (0.07 + growth * vec4(0.11, 0.07, 0.09, 0.0))
                + dot(hills, east) * growth * vec4(0.08, 0.0, 0.05, -0.06);

    // Clouds between the Sun and the ground: what lies towards the Sun, by the layer's height.
    float mu_shadow = max(mu_sun, 0.15);
    vec3 towards_sun = (sun - mu_sun * normal) * (cloud_km / mu_shadow);
    vec2 shaded_place = place + 2.0 * fray + kilometre
                      * vec2(dot(towards_sun, east), -dot(towards_sun, north));
    vec4 shading = textureLod(weather_map, shaded_place, level);
    vec3 shaded_in_noise = in_noise + noise_step(towards_sun, NOISE_TILE_KM);
    float shade_level = textureLod(noise_volume, shaded_in_noise, 0.0).w;
    float shade = mix(shading.x, cover_here(shading.x, shade_level, shading.w), detail);
    float mu_light = max(mu_sun, 0.05);
    float tau = cloud_thickness(weather.y);
    float reflected = cloud_reflectance(tau, mu_light);
    float through = 1.0 - shade * reflected;

    // The sea; the waves' glint takes only light that no cloud has scattered.
    float mu_view = max(dot(normal, view), 0.0);
    float variance = wave_slope_variance * (1.0 + 0.1 * grain);
    float sky_mirror = sky_in_waves(mu_view, variance);
    vec4 water = water_body / PI * (direct * lit + diffuse) * through
               + diffuse * through * sky_mirror / PI
               + direct * glint(normal, sun, view, variance) * (1.0 - shade);
    float shore_km = (form.z - ZERO_CODE.z) * SHORE_KM + 0.4 * grain;
    float sea = clamp(0.5 + shore_km / max(footprint_km, 0.4), 0.0, 1.0);
    vec4 below = mix(land / PI * (direct * lit_land + diffuse) * through, water, sea);

    // Lamps are on from sunset. A level's sixth power has the mean 1 / 7.
    float level2 = noise.w * noise.w;
    float lamps = form.w * form.w * (1.0 + detail * (7.0 * level2 * level2 * level2 - 1.0));
    below += here.to_ground * night_radiance * (lamps * clamp(0.5 - 12.0 * mu_sun, 0.0, 1.0));

    // Clouds between the ground and the camera. Where the level is high they are thick; what looks
    // towards the Sun is bright.
    float cover = clouds_below * mix(weather.x, cover_here(weather.x, noise.w, weather.w), detail);
    float relief = (0.1 + 0.4 * weather.w) * thicker(weather.x, noise.w, weather.w)
                 + 0.5 * max(2.0 * weather.x - 1.0, 0.0) * (noise.w - shade_level);
    float bright = cover * reflected * (1.0 + detail * (1.0 - reflected) * relief);
    float back = cover * cloud_diffuse_reflectance(tau);
    float high_tau = clouds_below * high_cloud_thickness * weather.z * (1.0 + 0.3 * grain);
    float high = high_tau / (high_tau + 7.7 * mu_light), high_back = high_tau / (high_tau + 7.7);
    float past_high = (1.0 - high) * (1.0 - high_back), past_low = 1.0 - back;
    return here.white * (high + bright * past_high) + below * (past_low * past_high)
         - here.beneath * (1.0 - past_low * past_high);
#endif
}
