// What land, sea and clouds send up of the light that reaches them [W m-2 sr-1].
#include "block/planet"
#include "planet/cloud.glsl"
#include "planet/night.glsl"
#include "planet/ocean.glsl"
#include "planet/place.glsl"
#ifdef REGOLITH
#include "planet/regolith.glsl"
#endif

#ifndef SEA
uniform sampler2D land_map;   // square roots of reflectance R, G, B, N
uniform sampler2D form_map;   // slopes to the east and north, shore, night lights
#endif
uniform sampler2D weather_map;   // share of cloud, thickness code, thin high cloud, raggedness

// Steps of the maps' codes, as in tools/earth_maps.py.
const float ROOT_SLOPE_STEP = 255.0 / 120.0;
const float SHORE_KM = 255.0 / 6.0;
const vec3 ZERO_CODE = vec3(128.0 / 255.0);
// Mean of max(1 - 3 |g|, 0) for a normal g: 2 phi(0) (1/3 - 1/6) to first order.
const float BED_MEAN = 0.131;

// What comes from ground and clouds to the camera [W m-2 sr-1], and how much passes the clouds.
struct Sight {
    vec4 light;
    float past;
};

// Of a place on the ellipsoid and the clouds before it, on top of all that the air scatters before the
// ground: what clouds hide of that is taken off.
//
// on_earth, on_clouds : shares of the pixel that lie on the ground, and on the clouds' sphere
Sight ground_sight(Place here, float on_earth, float on_clouds) {
    vec3 normal = here.normal, view = here.view, sun = sun_direction_itrf.xyz;
    float lit = here.lit, mu_sun = dot(normal, sun);
    vec4 direct = here.direct, diffuse = here.diffuse;
#ifdef REGOLITH
    // Its geometric albedo is that of a Lambertian globe of `earth_albedo`.
    if (lit <= 0.0) return Sight(vec4(0.0), 1.0);
    float r = regolith_reflectance(lit, max(dot(normal, view), 1e-3), dot(view, sun));
    return Sight(on_earth * regolith_scale * earth_albedo * direct * r, 1.0);
#elif !defined(EARTH_MAPS)
    return Sight(on_earth * earth_albedo / PI * (direct * lit + diffuse), 1.0);
#else
    float level = here.levels.x, halvings = here.levels.y;
    float kept = here.kept.x;

#ifndef SEA
    // Noise below the maps' resolution, as far as the pixel resolves it: slopes to east and north.
    vec2 along = noise_at(here.ground, halvings).xy;
#if defined(EVEN) && !defined(ONE_FACE)
    vec2 turn = turn_at(normal);
#else
    vec2 turn = here.turn;
#endif
    vec2 hills = mat2(turn, -turn.y, turn.x) * along;
    float kept_hills = here.kept.y, grain = 0.7071 * (along.x + along.y);
    // It frays what lies between two texels of the maps.
    float across = max(length(normal.xy), 1e-4);
    vec2 fray = vec2(0.5 / across, 1.0) / (planet_km * PI) * hills.yx;
    vec4 form = textureLod(form_map, here.ground.on_map + fray, level);
    vec4 land = textureLod(land_map, here.ground.on_map + fray, level);

    // Relief: slopes of the map, and hills that are the steeper the more rugged the map.
    vec2 root = (form.xy - ZERO_CODE.xy) * ROOT_SLOPE_STEP;
    vec2 slope = root * abs(root);
    slope += min(0.01 + 4.0 * length(slope), 0.35) * hills;
    vec2 level_sun = vec2(normal.x * sun.y - normal.y * sun.x,
                          sun.z - mu_sun * normal.z) / across;
    // No finer at the terminator than hills are rough.
    float lit_land = max((mu_sun - dot(slope, level_sun)) * inversesqrt(1.0 + dot(slope, slope)), 0.0);
    // Ground and growth change from hill to hill, growth most where there is some.
    land *= land;
    float growth = clamp(4.0 * (land.a - 1.2 * land.r), 0.0, 1.0);
    // Valleys and dry beds run where a slope turns; their mean darkness is taken off.
    float bed = max(1.0 - 3.0 * abs(along.x) * inversesqrt(max(kept_hills, 1e-3)), 0.0) - BED_MEAN;
    land *= 1.0 - 0.22 * kept_hills * bed + grain * (0.07 + growth * vec4(0.11, 0.07, 0.09, 0.0))
                + hills.x * growth * vec4(0.08, 0.0, 0.05, -0.06);
#endif

    // Clouds between the Sun and the ground, where its light comes through their layer.
    vec4 shading = textureLod(weather_map, here.shade.on_map, level);
    float shade_noise = cloud_noise(noise_at(here.shade, halvings), shading.w);
    float shade = cover_here(shading.x, shade_noise, kept, cloud_softness(shading.w));
    vec4 weather = textureLod(weather_map, here.cloud.on_map, level);
    float mu_light = max(mu_sun, 0.05);
    float tau = cloud_thickness(weather.y);
    float reflected = cloud_reflectance(tau, mu_light);
    float through = 1.0 - shade * reflected;

    // The sea; the waves' glint takes only light that no cloud has scattered.
    float mu_view = max(dot(normal, view), 0.0);
    float variance = wave_slope_variance;
    float sky_mirror = sky_in_waves(mu_view);
#ifdef AIR_INSIDE
    vec4 sky = here.sky;
#else
    vec4 sky = diffuse / PI;
#endif
    vec4 water = water_body / PI * (direct * lit + diffuse) * through
               + sky * through * sky_mirror
               + direct * glint(normal, sun, view, variance) * (1.0 - shade);
#ifdef SEA
    vec4 below = water;
#else
    float shore_km = (form.z - ZERO_CODE.z) * SHORE_KM + 0.4 * grain;
    float sea = clamp(0.5 + shore_km / max(here.footprint, 0.4), 0.0, 1.0);
    vec4 below = mix(land / PI * (direct * lit_land + diffuse) * through, water, sea);

#ifdef NIGHT
    // Lamps are on from sunset, most where the ground is level. For slopes of variance v along both
    // axes the mean of exp(-1.5 slope^2) is 1 / (1 + 3 v).
    float lamps = form.w * form.w * exp(-1.5 * dot(along, along)) * (1.0 + 3.0 * kept_hills);
    below += here.to_ground * night_radiance * (lamps * dusk(mu_sun));
#endif
#endif

    // Clouds between the ground and the camera. Where the noise is high they are thick; what looks
    // towards the Sun is bright.
    float noise = cloud_noise(noise_at(here.cloud, halvings), weather.w);
    float softness = cloud_softness(weather.w);
    float cover = clouds_below * cover_here(weather.x, noise, kept, softness);
    float relief = 0.35 * thicker(weather.x, noise, kept, softness)
                 + 0.2 * max(2.0 * weather.x - 1.0, 0.0) * (noise - shade_noise);
    float bright = cover * reflected * max(1.0 + (1.0 - reflected) * relief, 0.0);
    float back = cover * cloud_diffuse_reflectance(tau);
    float high_tau = clouds_below * high_cloud_thickness * weather.z
                   * fibres(here.cloud, halvings, kept);
    float high = high_tau / (high_tau + 7.7 * mu_light), high_back = high_tau / (high_tau + 7.7);
    float past_high = (1.0 - high) * (1.0 - high_back);
    float past = past_high * (1.0 - back);
    vec4 layer = here.white * (high + bright * past_high) - here.beneath * (1.0 - past);
    return Sight(on_clouds * layer + on_earth * past * below, 1.0 - on_clouds * (1.0 - past));
#endif
}
