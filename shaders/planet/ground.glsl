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

// What comes from ground and clouds to the camera [W m-2 sr-1], and the fraction of the light from
// behind that passes the clouds.
struct Sight {
    vec4 light;
    float transmittance;
};

#ifdef EARTH_MAPS
// The clouds about a place.
struct Clouds {
    vec4 weather;        // of the map, where the camera sees the clouds
    float shade;         // fraction of the Sun's light on the ground that they cover
    float shade_noise;   // of the clouds between the Sun and the ground
    float thickness;     // optical
    float mu_light;      // cosine of the light on them
    float reflected;     // reflectance for it
    float through;       // fraction of the light that reaches the ground
};

// The clouds between the Sun and the ground, where its light comes through their layer.
Clouds clouds_over(Place here, float mu_sun) {
    float level = here.levels.x, halvings = here.levels.y, resolved = here.resolved.x;
    vec4 shading = textureLod(weather_map, here.shade.on_map, level);
    Clouds clouds;
    clouds.shade_noise = cloud_noise(noise_at(here.shade, halvings), shading.w);
    clouds.shade = cloud_cover(shading.x, clouds.shade_noise, resolved, cloud_softness(shading.w));
    clouds.weather = textureLod(weather_map, here.cloud.on_map, level);
    clouds.mu_light = max(mu_sun, 0.05);
    clouds.thickness = cloud_thickness(clouds.weather.y);
    clouds.reflected = cloud_reflectance(clouds.thickness, clouds.mu_light);
    clouds.through = 1.0 - clouds.shade * clouds.reflected;
    return clouds;
}

#ifndef SEA
// The land at a place.
struct Land {
    vec4 reflectance;
    float lit;        // cosine of the Sun on its slopes
    float shore_km;   // way into the sea, negative on land
    float lamps;      // radiance of cities over that of the brightest
};

Land land_at(Place here, float mu_sun) {
    vec3 normal = here.normal, sun = sun_direction_itrf.xyz;
    float level = here.levels.x, halvings = here.levels.y;
    // Noise below the maps' resolution, as far as the pixel resolves it: slopes to east and north.
    vec2 along = noise_at(here.ground, halvings).xy;
#if defined(EVEN) && !defined(ONE_FACE)
    vec2 turn = turn_at(normal);
#else
    vec2 turn = here.turn;
#endif
    vec2 hills = mat2(turn, -turn.y, turn.x) * along;
    float resolved_hills = here.resolved.y, grain = 0.7071 * (along.x + along.y);
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
    Land seen;
    // No finer at the terminator than hills are rough.
    seen.lit = max((mu_sun - dot(slope, level_sun)) * inversesqrt(1.0 + dot(slope, slope)), 0.0);
    // Ground and growth change from hill to hill, growth most where there is some; the gains are
    // chosen by eye.
    land *= land;
    float growth = clamp(4.0 * (land.a - 1.2 * land.r), 0.0, 1.0);
    // Valleys and dry beds run where a slope turns; their mean darkness is taken off.
    float bed = max(1.0 - 3.0 * abs(along.x) * inversesqrt(max(resolved_hills, 1e-3)), 0.0) - BED_MEAN;
    land *= 1.0 - 0.22 * resolved_hills * bed + grain * (0.07 + growth * vec4(0.11, 0.07, 0.09, 0.0))
                + hills.x * growth * vec4(0.08, 0.0, 0.05, -0.06);
    seen.reflectance = land;
    seen.shore_km = (form.z - ZERO_CODE.z) * SHORE_KM + 0.4 * grain;
    // Lamps shine most where the ground is level. For slopes of variance v along both axes the mean
    // of exp(-1.5 slope^2) is 1 / (1 + 3 v).
    seen.lamps = form.w * form.w * exp(-1.5 * dot(along, along)) * (1.0 + 3.0 * resolved_hills);
    return seen;
}
#endif

// What the sea sends up; the waves' glint takes only light that no cloud has scattered.
vec4 sea_light(Place here, Clouds clouds) {
    float mu_view = max(dot(here.normal, here.view), 0.0);
    float sky_mirror = sky_in_waves(mu_view);
#ifdef AIR_INSIDE
    vec4 sky = here.sky;
#else
    vec4 sky = here.diffuse / PI;
#endif
    return water_body / PI * (here.direct * here.lit + here.diffuse) * clouds.through
         + sky * clouds.through * sky_mirror
         + here.direct * glint(here.normal, sun_direction_itrf.xyz, here.view, wave_slope_variance)
           * (1.0 - clouds.shade);
}

// What the ground below the clouds sends up.
vec4 surface_light(Place here, Clouds clouds, float mu_sun) {
    vec4 water = sea_light(here, clouds);
#ifdef SEA
    return water;
#else
    Land land = land_at(here, mu_sun);
    float sea = clamp(0.5 + land.shore_km / max(here.footprint, 0.4), 0.0, 1.0);
    vec4 light = mix(land.reflectance / PI * (here.direct * land.lit + here.diffuse) * clouds.through,
                     water, sea);
#ifdef NIGHT
    // Lamps are on from sunset.
    light += here.to_ground * night_radiance * (land.lamps * dusk(mu_sun));
#endif
    return light;
#endif
}

// The clouds between the ground and the camera, over the light from below them. Where the noise is
// high they are thick; what looks towards the Sun is bright.
Sight through_clouds(Place here, Clouds clouds, vec4 below, float on_earth, float on_clouds) {
    float halvings = here.levels.y, resolved = here.resolved.x, reflected = clouds.reflected;
    vec4 weather = clouds.weather;
    float noise = cloud_noise(noise_at(here.cloud, halvings), weather.w);
    float softness = cloud_softness(weather.w);
    float cover = clouds_below * cloud_cover(weather.x, noise, resolved, softness);
    float relief = 0.35 * thicker(weather.x, noise, resolved, softness)
                 + 0.2 * max(2.0 * weather.x - 1.0, 0.0) * (noise - clouds.shade_noise);
    float bright = cover * reflected * max(1.0 + (1.0 - reflected) * relief, 0.0);
    float back = cover * cloud_diffuse_reflectance(clouds.thickness);
    float high_tau = clouds_below * high_cloud_thickness * weather.z
                   * fibres(here.cloud, halvings, resolved);
    // Thin ice clouds reflect tau / (tau + 7.7 mu): the two-stream limit (1 - g) tau / 2 for an
    // asymmetry g of 0.74.
    float high = high_tau / (high_tau + 7.7 * clouds.mu_light);
    float high_back = high_tau / (high_tau + 7.7);
    float past_high = (1.0 - high) * (1.0 - high_back);
    float past = past_high * (1.0 - back);
    vec4 layer = here.white * (high + bright * past_high) - here.beneath * (1.0 - past);
    return Sight(on_clouds * layer + on_earth * past * below, 1.0 - on_clouds * (1.0 - past));
}
#endif

// Of a place on the ellipsoid and the clouds before it, on top of all that the air scatters before the
// ground: what clouds hide of that is taken off.
//
// on_earth, on_clouds : fractions of the pixel that lie on the ground, and on the clouds' sphere
Sight ground_sight(Place here, float on_earth, float on_clouds) {
    float mu_sun = dot(here.normal, sun_direction_itrf.xyz);
#ifdef REGOLITH
    // Its geometric albedo is that of a Lambertian globe of `earth_albedo`.
    if (here.lit <= 0.0) return Sight(vec4(0.0), 1.0);
    float r = regolith_reflectance(here.lit, max(dot(here.normal, here.view), 1e-3),
                                   dot(here.view, sun_direction_itrf.xyz));
    return Sight(on_earth * regolith_scale * earth_albedo * here.direct * r, 1.0);
#elif !defined(EARTH_MAPS)
    return Sight(on_earth * earth_albedo / PI * (here.direct * here.lit + here.diffuse), 1.0);
#else
    Clouds clouds = clouds_over(here, mu_sun);
    vec4 below = surface_light(here, clouds, mu_sun);
    return through_clouds(here, clouds, below, on_earth, on_clouds);
#endif
}
