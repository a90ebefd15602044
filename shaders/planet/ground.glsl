// What land, sea and clouds send up of the light that reaches them [W m-2 sr-1].
#include "block/planet"
#include "common/constants.glsl"
#include "air/places.glsl"
#if defined(BANDS) && defined(EARTH_MAPS)
#include "block/groundbands"
#endif
#include "planet/cloud.glsl"
#ifdef FROST
#include "planet/frost.glsl"
#endif
#ifdef NIGHT
#include "planet/cities.glsl"
#endif
#include "planet/night.glsl"
#include "planet/ocean.glsl"
#include "planet/place.glsl"
#ifdef REGOLITH
#include "planet/regolith.glsl"
#endif

#ifndef SEA
uniform sampler2D land_map;   // square roots of reflectance R, G, B, N
uniform sampler2D form_map;   // slopes to the east and north
#ifndef LAND
uniform sampler2D shore_map;  // distance to the shore
#endif
#ifdef NIGHT
uniform sampler2D lamp_map;   // lights at night
#endif
#endif
#if defined(BANDS) && defined(EARTH_MAPS)
#ifndef SEA
uniform sampler2D land_kind;   // how much grows, how dark it is in red, how white the map is
#endif
// By code of the thickness and root of the Sun's cosine: reflectance over that of a cloud that absorbs
// nothing; share of the Sun's light that does not come through (simgl/physics/earth_spectra.py).
uniform sampler3D cloud_bands;
#endif
uniform sampler2D weather_map;   // share of cloud, thickness code, thin high cloud, kind

// Steps of the maps' codes, as in tools/earth_maps.py.
const float ROOT_SLOPE_STEP = 255.0 / 120.0;
const float SHORE_KM = 255.0 / 6.0;
// The map knows the way to the shore only as far as its codes reach: within a pixel larger than the
// way between their ends, the mean code is the share of water.
const float LARGEST_SHORE_KM = 42.0;
// Light that the air scatters comes from so far around: scale heights of the air on either side. The map's
// halving for it is even over a tile, whose corners alone may be asked.
const float AROUND_KM = 16.0;
const float AROUND_LEVEL = 4.0;
const float ZERO_CODE = 128.0 / 255.0;
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
//
// seen, shading        : how noise breaks up those that the camera sees, and those before the Sun
// kinds                : what the kinds of cloud have of that noise
// overhang             : what towers of closed cloud gain where they look towards the Sun, more where it is low
// sides                : of towers, light over that of level tops: as they rise towards what lies sunwards
// around               : reflectance over tens of kilometres
// reflected, back      : reflectance for the Sun's light, and for light from all sides
// shape                : reflectance towards the camera over its mean
// high_tau             : optical thickness of thin high cloud
// darkened, lost       : reflectance over that without absorption; of the Sun's light, what does not
//                        come through (BANDS)
struct Clouds {
    Broken seen;
    Broken shading;
    vec4 kinds;
    float overhang;
    float sides;
    float around;
    float reflected;
    float back;
    float shape;
    float high_tau;
#ifdef BANDS
    vec4 darkened;
    vec4 lost;
#endif
};

float cosine_on_clouds(Place here) {
    return max(here.mu_sun, 0.05);
}

Clouds clouds_at(Place here) {
    float level = here.levels.x - weather_halvings;
    vec4 shading = textureLod(weather_map, here.shade.on_map, level);
    vec4 weather = textureLod(weather_map, here.cloud.on_map, level);
    float thickness = cloud_thickness(weather.y);
    Clouds clouds;
    // Those before the Sun are of the same kind.
    clouds.kinds = cloud_kinds(weather.w);
    vec4 shares = clouds.kinds * clouds.kinds;
    float resolved = dot(shares, here.resolved_clouds), softness = cloud_softness(shares);
    clouds.seen = broken_up(weather.x, resolved, softness);
    clouds.shading = broken_up(shading.x, resolved, softness);
    clouds.overhang = 0.2 / (0.2 + cosine_on_clouds(here)) * max(2.0 * weather.x - 1.0, 0.0);
    // Over the way to there the Sun's light falls by the layer's height, and what rises by that has twice
    // the light of level ground; what falls by it has none. Decks and cumulus have no towers.
    float rise = tower_height(weather.xy) - tower_height(shading.xy);
    clouds.sides = shares.w * clamp(rise * (tower_km / max(cloud_km, 1.0)), -0.8, 0.8);
    clouds.reflected = cloud_reflectance(thickness, cosine_on_tops(here.mu_sun));
    clouds.around = clouds_below * weather.x * clouds.reflected;
    clouds.back = cloud_diffuse_reflectance(thickness);
    clouds.shape = cloud_shape(here.light.cloud_shape, weather.y);
    clouds.high_tau = clouds_below * high_cloud_thickness * weather.z;
#ifdef BANDS
    vec2 size = vec2(textureSize(cloud_bands, 0));
    vec2 place = vec2(table_place(weather.y, size.x), table_place(sqrt(max(here.mu_sun, 0.0)), size.y));
    clouds.darkened = textureLod(cloud_bands, vec3(place, 0.25), 0.0);
    clouds.lost = textureLod(cloud_bands, vec3(place, 0.75), 0.0);
#endif
    return clouds;
}

// The clouds before the Sun as a pixel sees them.
//
// cover   : fraction of the Sun's light on the ground that they cover
// noise   : theirs
// through : fraction of the light that reaches the ground
// back    : fraction of the light from the ground that they send back
struct Shade {
    float cover;
    float noise;
#ifdef BANDS
    vec4 through;
#else
    float through;
#endif
    float back;
};

#ifdef BANDS
const Shade NO_SHADE = Shade(0.0, 0.0, vec4(1.0), 0.0);
#else
const Shade NO_SHADE = Shade(0.0, 0.0, 1.0, 0.0);
#endif

Shade shade_at(Place here, Clouds clouds) {
    float noise = clouds_noise(here.shade, here.levels.y, clouds.kinds);
    float cover = cloud_cover(clouds.shading, noise);
#ifdef BANDS
    vec4 through = 1.0 - cover * clouds.lost;
#else
    float through = 1.0 - cover * clouds.reflected;
#endif
    return Shade(cover, noise, through, cover * clouds.back);
}

// Light that the sea sends up: all that clouds dim, and the waves' glint, which takes only light that no
// cloud has scattered.
struct Sea {
    vec4 light;
    vec4 glint;
};

// Mean square slope of the waves at a place, by the wind there (simgl/physics/sea_surface.py).
float slope_variance_at(Place here) {
    float wind = here.wind;
#ifdef GLINT
    vec3 half_way = normalize(sun_direction_itrf.xyz + here.view);
    float cosine = max(dot(half_way, here.normal), 0.05);
    float seen = clamp((NO_DETAIL + 1.0 - 1.0 / (cosine * cosine)) / (NO_DETAIL - DETAIL_FADES), 0.0, 1.0);
    wind = mix(wind, wind_at_work(wind, eddies_at(here.ground, here.levels.y)), seen);
#endif
    return CALM_SLOPES + (wave_slope_variance - CALM_SLOPES) * wind;
}

// Diffuse reflectance of water and foam, without what the surface mirrors. Foam by Monahan's law.
vec4 body_at(Place here) {
    return mix(clear_water, foam, min(foam_cover * pow(here.wind, FOAM_POWER), 1.0));
}

Sea sea_at(Place here) {
    float mu_view = max(dot(here.normal, here.view), 0.0);
#ifdef AIR_INSIDE
    vec4 sky = here.light.sky;
#else
    vec4 sky = here.light.diffuse / PI;
#endif
    vec4 body = body_at(here) / PI * (here.light.direct * here.lit + here.light.diffuse);
#ifdef BANDS
    sky *= water_mirror;
    float waves = glint(here.normal, sun_direction_itrf.xyz, here.view, slope_variance_at(here));
    return Sea(body + sky * sky_in_waves(mu_view), here.light.direct * waves * water_mirror);
#else
    return Sea(body + sky * sky_in_waves(mu_view),
               here.light.direct
               * glint(here.normal, sun_direction_itrf.xyz, here.view, slope_variance_at(here)));
#endif
}

// What ground gets of the light that goes back and forth between it and the air, over the same for ground
// of the Earth's mean.
vec4 by_air(vec4 around) {
    return (1.0 - mean_ground * air_from_below) / (1.0 - around * air_from_below);
}

// By how much ground is brighter, with that, than the one for which the air's light was made.
vec4 brighter(vec4 around) {
    return max(around * by_air(around) - mean_ground, vec4(0.0));
}

#ifndef SEA
// Slopes of the map to the east and north; codes are their roots.
vec2 mapped_slope(vec2 form) {
    vec2 root = (form - ZERO_CODE) * ROOT_SLOPE_STEP;
    return root * abs(root);
}

// How much grows there, by its colours.
//
// kind : of the map there, that bands do not tell (BANDS)
float growth_of(vec4 land, vec3 kind) {
#ifdef BANDS
    return kind.x;
#else
    return clamp(4.0 * (land.a - 1.35 * land.r), 0.0, 1.0);
#endif
}

vec3 kind_at(vec2 on_map, float level) {
#ifdef BANDS
    return textureLod(land_kind, on_map, level).xyz;
#else
    return vec3(0.0);
#endif
}

// By how much growth changes from hill to hill: with the grain, and with the slope.
#ifdef BANDS
#define BY_GRAIN growth_by_grain
#define BY_SLOPE growth_by_slope
#else
#define BY_GRAIN vec4(0.09, 0.06, 0.075, 0.0)
#define BY_SLOPE vec4(0.065, 0.0, 0.04, -0.05)
#endif

// A place with what the land around it sends to air and clouds.
Place with_land_around(Place here) {
    float level = max(here.levels.x, AROUND_LEVEL) - map_halvings.x;
    vec4 land = textureLod(land_map, here.ground.on_map, level);
    land *= land;
#ifdef FROST
    vec3 kind = kind_at(here.ground.on_map, level);
    land = with_snow(land, growth_of(land, kind), kind, here.ground.on_map, 0.0, 0.0);
#endif
    vec4 gain = by_air(land) / PI;
    here.light.land_direct = here.light.direct * gain;
    here.light.land_diffuse = here.light.diffuse * gain;
    here.light.land_aloft = here.light.aloft * brighter(land);
    here.light.around = land;
    return here;
}

// The land at a place.
struct Land {
    vec4 reflectance;
    float lit;        // cosine of the Sun on its slopes
    float shore_km;   // way into the sea, negative on land
    vec2 lamps_at;    // place on the maps, bent by hills as towns are
    float lamps;      // code of the map of lights
    float road;       // light of roads over its mean
};

Land land_at(Place here) {
    float level = here.levels.x - map_halvings.x;
    // Noise below the maps' resolution, as far as the pixel resolves it: slopes to east and north.
    vec4 noise = noise_at(chart, here.ground, here.levels.y);
    vec2 along = noise.xy;
    vec2 hills = mat2(here.turn, -here.turn.y, here.turn.x) * along;
    float resolved_hills = here.resolved.x, grain = 0.7071 * (along.x + along.y);
    // It frays what lies between two texels of the maps.
    vec2 frayed = here.ground.on_map + here.fray * hills.yx;
#ifdef RELIEF_AT_CORNERS
    vec2 slope = here.slope;
#else
    vec2 slope = mapped_slope(textureLod(form_map, frayed, here.levels.x - map_halvings.y).rg);
#endif
    vec4 land = textureLod(land_map, frayed, level);

    // Relief: slopes of the map, and hills that are the steeper the more rugged the map.
    slope += min(0.01 + 3.0 * length(slope), 0.35) * hills;
    Land seen;
    // No finer at the terminator than hills are rough.
    seen.lit = max((here.mu_sun - dot(slope, here.level_sun)) * inversesqrt(1.0 + dot(slope, slope)), 0.0);
    // Ground and growth change from hill to hill, growth most where there is some; the gains are
    // chosen by eye.
    land *= land;
    vec3 kind = kind_at(frayed, level);
    float growth = growth_of(land, kind);
    // Valleys and dry beds run where a slope turns; their mean darkness is taken off.
    float bed = max(1.0 - here.bed_steepness * abs(along.x), 0.0) - BED_MEAN;
    land *= 1.0 - 0.19 * resolved_hills * bed + 0.06 * grain
          + (grain * growth) * BY_GRAIN + (hills.x * growth) * BY_SLOPE;
#ifdef FROST
    land = with_snow(land, growth, kind, here.ground.on_map, length(slope),
                     noise_at(cloud_chart, here.ground, here.levels.y).w);
#endif
    seen.reflectance = land;
#ifndef LAND
    float shore = textureLod(shore_map, frayed, here.levels.x - map_halvings.z).r;
    seen.shore_km = (shore - ZERO_CODE) * SHORE_KM + 0.4 * grain;
#endif
#ifdef NIGHT
    seen.lamps = textureLod(lamp_map, frayed, here.levels.x - map_halvings.w).r;
    // By half a kilometre for a slope of 1, along meridians as along parallels.
    seen.lamps_at = here.ground.on_map + 0.6 * here.fray * hills.yx;
    // Roads run where a slope turns. For slopes of variance v the mean of exp(-20 slope^2) is
    // 1 / sqrt(1 + 40 v).
    seen.road = exp(-20.0 * along.x * along.x) * sqrt(1.0 + 40.0 * resolved_hills);
#endif
    return seen;
}
#endif

// The share of the light that comes through the clouds, with what they send back to the ground: to first
// order in the differences between bands, which is right to 2 % over snow.
//
// around : the ground's reflectance
vec4 by_clouds(vec4 around, Shade shade) {
#ifdef BANDS
    return shade.through / (1.0 - around * shade.back);
#else
    float grey = around.g, again = 1.0 / (1.0 - grey * shade.back);
    return shade.through * again * (1.0 + (around - grey) * (shade.back * again));
#endif
}

// What the ground below the clouds sends up.
vec4 surface_light(Place here, Sea sea, Shade shade) {
    vec4 water = sea.light * shade.through + sea.glint * (1.0 - shade.cover);
#if defined(FROST) && !defined(LAND)
    // The clouds' puffs: hills have no floes.
    float floes = noise_at(cloud_chart, here.ground, here.levels.y).w;
    float north = degrees_north(here.ground.on_map);
    vec4 ice = ice_reflectance[north > 0.0 ? 0 : 1];
    vec4 below_ice = by_clouds(ice, shade);
    vec4 on_ice = (here.light.direct * here.lit + here.light.diffuse) * by_air(ice) * below_ice;
    water = mix(water, ice / PI * on_ice, ice_share(here.ground.on_map, north, floes))
          + ice_share(here.ground.on_map, north, 0.0) * below_ice * brighter(ice) * here.light.aloft;
#endif
#ifdef SEA
    return water;
#else
    Land land = land_at(here);
    vec4 below = by_clouds(here.light.around, shade);
    vec4 light = land.reflectance * (here.light.land_direct * land.lit + here.light.land_diffuse);
#ifdef LAND
    light = (light + here.light.land_aloft) * below;
#else
    light *= below;
    float across_km = clamp(here.footprint, 0.4, LARGEST_SHORE_KM);
    light = mix(light, water, clamp(0.5 + land.shore_km / across_km, 0.0, 1.0))
          + clamp(0.5 - land.shore_km / AROUND_KM, 0.0, 1.0) * below * here.light.land_aloft;
#endif
#ifdef NIGHT
    // Lamps are on from sunset.
    light += here.light.to_ground * dusk(here.mu_sun)
           * city_lights(land.lamps, land.lamps_at, here.footprint, land.road);
#endif
    return light;
#endif
}

// The clouds between the ground and the camera, over the light from below them. Where the noise is
// high they are thick; what looks towards the Sun is bright, what looks away has the sky's light alone.
Sight through_clouds(Place here, Clouds clouds, Shade shade, vec4 below, float on_earth, float on_clouds) {
    float reflected = clouds.reflected, halvings = here.levels.y;
    float noise = clouds_noise(here.cloud, halvings, clouds.kinds);
    float cover = clouds_below * cloud_cover(clouds.seen, noise);
    float relief = 0.35 * (noise - clouds.seen.mean) + clouds.overhang * (noise - shade.noise);
    float facing = max((1.0 - reflected) * relief + clouds.sides, -1.0);
    float bright = cover * reflected * clouds.shape, past = 1.0 - cover * clouds.back;
#ifndef NO_HIGH_CLOUD
    float high_tau = clouds.high_tau * fibres(here.cloud, halvings, here.resolved.y);
    // Thin ice clouds reflect tau / (tau + 7.7 mu): the two-stream limit (1 - g) tau / 2 for an
    // asymmetry g of 0.74.
    float diffuse_high = high_tau + 7.7, slanted = 7.7 * cosine_on_clouds(here), direct_high = high_tau + slanted;
    float over_both = 1.0 / (diffuse_high * direct_high);
    float high = high_tau * diffuse_high * over_both, past_high = 7.7 * slanted * over_both;
    bright *= past_high;
    past *= past_high;
#else
    float high = 0.0;
#endif
#ifdef BANDS
    vec4 layer = (here.light.white * bright + here.light.sunny * (bright * facing)) * clouds.darkened;
#ifndef NO_HIGH_CLOUD
    layer += here.light.white_high * ice_cloud * high;
#endif
#else
    vec4 layer = here.light.white * (bright + high) + here.light.sunny * (bright * facing);
#endif
    // Air above scatters the light of a bright deck, too; the air beneath has what light comes through.
    layer += max(clouds.around - mean_ground, 0.0) * here.light.aloft_high;
    layer -= here.light.beneath * (1.0 - past * (1.0 - cover * reflected));
    return Sight(on_clouds * layer + on_earth * past * below, 1.0 - on_clouds * (1.0 - past));
}

// Of a place, and what the sea there would send up; CLEAR: of one without clouds.
Sight mapped_sight(Place here, Sea sea, float on_earth, float on_clouds) {
#ifdef CLEAR
    return Sight(on_earth * surface_light(here, sea, NO_SHADE), 1.0);
#else
    Clouds clouds = clouds_at(here);
    Shade shade = shade_at(here, clouds);
    return through_clouds(here, clouds, shade, surface_light(here, sea, shade), on_earth, on_clouds);
#endif
}
#endif

// Of a place on the ellipsoid and the clouds before it, on top of all that the air scatters before the
// ground: what clouds hide of that is taken off.
//
// on_earth, on_clouds : fractions of the pixel that lie on the ground, and on the clouds' sphere
Sight ground_sight(Place here, float on_earth, float on_clouds) {
#ifdef REGOLITH
    // Its geometric albedo is that of a Lambertian globe of `earth_albedo`.
    if (here.lit <= 0.0) return Sight(vec4(0.0), 1.0);
    float r = regolith_reflectance(here.lit, max(dot(here.normal, here.view), 1e-3),
                                   dot(here.view, sun_direction_itrf.xyz));
    return Sight(on_earth * regolith_scale * earth_albedo * here.light.direct * r, 1.0);
#elif !defined(EARTH_MAPS)
    return Sight(on_earth * earth_albedo / PI * (here.light.direct * here.lit + here.light.diffuse), 1.0);
#else
    return mapped_sight(here, sea_at(here), on_earth, on_clouds);
#endif
}
