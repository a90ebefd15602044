// A place on the Earth as a pixel sees it, and the light there.
#include "block/planet"
#include "common/sun.glsl"
#include "air/daylight.glsl"
#include "planet/mirror.glsl"
#include "planet/night.glsl"
#include "planet/puffs.glsl"
#ifdef EARTH_MAPS
#include "planet/wind.glsl"
#endif
#ifdef AIR
#include "air/air.glsl"
#endif
#ifdef TOWERS
// Of the cloud that a ray meets: its height [km], and, above the layer, the cosine of the ray from the zenith there.
float layer_km, layer_mu;
#else
#define layer_km cloud_km
#endif

// Sines of the Sun's height at which its upper limb sets for level ground, and for the tops of relief 2 km over
// the ground around. From there the horizon dips by 0.0269 rad (Earth radius 7/6, for the ray's bend);
// refraction lifts the Sun by 0.0099 there, and its radius is 0.0047.
const float SETS_BELOW = -0.0047, SETS_ON_TOPS = -0.0415;

// Lower than this sine the Sun throws no longer shadows [km of way per km of height].
const float SHADOW_SINE = 0.10;

// Of a pixel's long edge on the ground: noise is no finer (simgl/view/background_tiles.py).
const float LONG_EDGE = 0.9;

// A place, and as its ``light`` what reaches the camera of light there: dimmed by the air on the way.
//
// normal    : of the ellipsoid, ITRF
// view      : unit, towards the camera, ITRF
// footprint : of the pixel [km]
// lit       : effective cosine of the Sun's disc
// direct    : irradiance by the Sun on a plane that faces it, at the ground, where it is up [W m-2]
// diffuse   : irradiance by the sky on the horizontal ground [W m-2]
// to_ground : transmittance from the ground to the camera
// white     : radiance of a white layer at the height of the clouds [W m-2 sr-1]
// sunny     : what of that is the Sun's light
// white_high : the same at the height of thin high clouds, above most of the water vapour (BANDS)
// beneath   : radiance that the air between ground and clouds adds [W m-2 sr-1]
// aloft     : what the air would scatter towards the camera of the light of white ground [W m-2 sr-1]
// aloft_high : the same above a white layer at the height of the clouds
// land_direct, land_diffuse, land_aloft, around : of land over tens of kilometres, over which air and clouds
//             mix what it sends up: direct and diffuse over pi with what the air sends back, over that of ground
//             of the Earth's mean; what the air scatters of its light beyond that of such ground; its reflectance
// sky       : radiance of the sky that level waves mirror (AIR_INSIDE; elsewhere the sky's mean)
// ground, cloud, shade : the spot seen, where the ray meets the clouds, where the Sun's light does
// turn      : of the chart's axes from east and north: cosine, sine
// mu_sun    : sine of the Sun's height
// wind      : over the sea, over its mean
// cloud_shape : reflectance of clouds towards the camera over their mean: of the thinnest, and by how much
//             each thicker kind has more (cloud_shape_at)
// level_sun : horizontal part of its direction, to east and north
// fray      : on the maps, of a way across and along a meridian by which hills fray them
// levels    : halvings of the finest map and of the chart that a pixel spans; of the map less than none
//             where a pixel is smaller than its texels
// resolved  : variance of hills' slopes and of ice fibres that it resolves
// bed_steepness : over hills' slopes from the beds of valleys up to where the ground is even
// resolved_clouds : of the kinds of cloud
struct PlaceLight {
    vec4 direct;
    vec4 diffuse;
    vec4 to_ground;
    vec4 white;
    vec4 sunny;
    vec4 beneath;
#ifdef EARTH_MAPS
#ifdef BANDS
    vec4 white_high;
#endif
    vec4 aloft;
    vec4 aloft_high;
#ifndef SEA
    vec4 land_direct;
    vec4 land_diffuse;
    vec4 land_aloft;
    vec4 around;
#endif
#ifdef AIR_INSIDE
    vec4 sky;
#endif
    vec4 cloud_shape;
#endif
};

struct Place {
    vec3 normal;
    vec3 view;
    float footprint;
    float lit;
    PlaceLight light;
#ifdef EARTH_MAPS
    Spot ground;
    Spot cloud;
    Spot shade;
    vec2 turn;
    float mu_sun;
    float wind;
    vec2 level_sun;
#ifdef RELIEF_AT_CORNERS
    vec2 slope;
#endif
    vec2 fray;
    vec2 levels;
    vec2 resolved;
    float bed_steepness;
    vec4 resolved_clouds;
#endif
};

#ifdef BANDS
// Height of thin high clouds [km].
const float HIGH_CLOUD_KM = 10.0;
#if defined(AIR) && !defined(AIR_INSIDE)
// By heights up to 16 km and the roots of the cosines of Sun and camera from the vertical
// (simgl/passes/background/air_tables.py).
uniform sampler3D air_pairs;

// What passes the air down to a height [km] and up again, over the product of both.
vec4 past_twice(float height, float mu_sun, float mu_view) {
    vec3 size = vec3(textureSize(air_pairs, 0));
    vec3 place = vec3(sqrt(clamp(vec2(mu_view, mu_sun), 0.0, 1.0)), height / 16.0);
    return textureLod(air_pairs, vec3(table_place(place.x, size.x), table_place(place.y, size.y),
                                      table_place(place.z, size.z)), 0.0);
}
#endif
#endif

#ifdef EARTH_MAPS
// By the cosines of Sun and camera and the azimuth between them (tools/cloud_reflection.py).
uniform sampler3D cloud_reflection;

// Reflectance of water clouds of four thicknesses in the Sun's light towards the camera, over its mean.
vec4 cloud_shape_at(vec3 n, vec3 view) {
    float mu_sun = dot(n, sun_direction_itrf.xyz), mu_view = dot(n, view);
    vec3 sun_level = mu_sun * n - sun_direction_itrf.xyz, view_level = view - mu_view * n;
    float cosine = dot(sun_level, view_level)
                 * inversesqrt(max(dot(sun_level, sun_level) * dot(view_level, view_level), 1e-12));
    float azimuth = acos(clamp(cosine, -1.0, 1.0)) / PI;
    // The first and the last azimuth are middles of texels.
    azimuth += (0.5 - azimuth) / float(textureSize(cloud_reflection, 0).z);
    return textureLod(cloud_reflection, vec3(mu_sun, mu_view, azimuth), 0.0);
}
#endif

vec2 place_on_map(vec3 n) {
    return vec2(atan(n.y, n.x) / (2.0 * PI) + 0.5, 0.5 - atan(n.z, max(length(n.xy), 1e-4)) / PI);
}

Spot spot_at(vec3 n, vec2 near) {
    vec2 on_map = place_on_map(n);
    // On the same side of the date line.
    on_map.x = near.x + fract(on_map.x - near.x + 0.5) - 0.5;
    return spot_on(on_map, n);
}

// Of the chart's axes there from east and north: cosine, sine.
vec2 turn_at(vec3 n) {
    vec3 east = vec3(-n.y, n.x, 0.0) / max(length(n.xy), 1e-4);
    return chart_turn(n, east, cross(n, east));
}

// Where a ray along `d` meets the ground at `t`, in sphere space; the cosine there, at least 1e-3.
// cloud_t : where it meets the clouds
Place place_at(vec3 d, float t, float cloud_t, float slant) {
    Place place;
    // The gradient of the sphere's equation, stretched back, is the ellipsoid's normal (ITRF).
    vec3 n = normalize((camera_in_sphere.xyz + t * d) * sphere_axes.xyz);
    place.normal = n;
    place.view = -normalize(d / sphere_axes.xyz);
    place.footprint = planet_km * t / (intrinsics.x * sqrt(slant));
    float mu_sun = dot(n, sun_direction_itrf.xyz);
    place.lit = disc_cosine(mu_sun, sun_angular_radius);
    Daylight day = air_daylight(mu_sun);
    // On fewer and fewer tops, whose slopes would face the Sun below the horizon all night.
    float risen = clamp((mu_sun - SETS_ON_TOPS) / (SETS_BELOW - SETS_ON_TOPS), 0.0, 1.0);
    place.light.direct = day.direct * (risen * risen);
    place.light.diffuse = day.diffuse;
    place.light.to_ground = vec4(1.0);
#ifdef EARTH_MAPS
    vec3 to_sun = sun_direction_itrf.xyz - mu_sun * n;
    vec3 shade = n + to_sun * (cloud_km / (planet_km * max(mu_sun, SHADOW_SINE)));
    vec3 cloud = (camera_in_sphere.xyz + cloud_t * d) * sphere_axes.xyz;
    vec2 on_map = place_on_map(n);
    place.ground = spot_at(n, on_map);
    place.cloud = spot_at(normalize(cloud), on_map);
    place.shade = spot_at(normalize(shade), on_map);
    place.turn = turn_at(n);
    place.mu_sun = mu_sun;
    place.wind = wind_varies > 0.0 ? wind_over(n, place.footprint) : 1.0;
    float across = max(length(n.xy), 1e-4);
    vec3 sun = sun_direction_itrf.xyz;
    place.level_sun = vec2(n.x * sun.y - n.y * sun.x, sun.z - mu_sun * n.z) / across;
    place.fray = vec2(0.25 / across, 0.5) / (planet_km * PI);
    vec2 texels = place.footprint / vec2(map_texel_km, chart_texel_km);
    place.levels = log2(texels);
    place.levels.y = chart_level(max(place.levels.y + max(log2(LONG_EDGE * inversesqrt(slant)), 0.0), 0.0));
    place.resolved = chart_variance[int(place.levels.y)].xy;
    place.bed_steepness = 3.0 * inversesqrt(max(place.resolved.x, 1e-3));
    place.resolved_clouds = cloud_variance[int(place.levels.y)];
    Daylight high = air_daylight_at(layer_km, mu_sun);
#ifdef NIGHT
    place.light.diffuse += glow_irradiance * nightfall(mu_sun);
    high.diffuse += glow_irradiance * nightfall(mu_sun);
#endif
    vec4 sunlight = high.direct * place.lit;
    place.light.white = (sunlight + high.diffuse) / PI;
    place.light.sunny = sunlight / PI;
    // What the sky sends is reflected evenly.
#ifdef BANDS
    float from_sun = dot(sunlight, vec4(1.0)) / max(dot(sunlight + high.diffuse, vec4(1.0)), 1e-20);
    Daylight highest = air_daylight_at(HIGH_CLOUD_KM, mu_sun);
    place.light.white_high = (highest.direct * place.lit + highest.diffuse) / PI;
#else
    float from_sun = sunlight.g / max(sunlight.g + high.diffuse.g, 1e-20);
#endif
    vec4 shape = mix(vec4(1.0), cloud_shape_at(n, place.view), from_sun);
    place.light.cloud_shape = vec4(shape.x, shape.yzw - shape.xyz);
    place.light.beneath = vec4(0.0);
    place.light.aloft = vec4(0.0);
    place.light.aloft_high = vec4(0.0);
#endif
    return place;
}

#ifdef AIR_INSIDE
// Height over which the sky that the camera sees stands for that over the sea [km].
const float SAME_SKY_KM = 4.0;

// The sky that waves mirror towards the camera, radiance there: mean of two heights, a standard
// deviation of what is mirrored above and below its mean.
vec4 sky_in_the_sea(Place place) {
    vec3 up = camera_up.xyz;
    float mu = dot(place.normal, place.view);
    vec3 level = normalize(-place.view + dot(place.view, up) * up + 1e-6);
    float mean = cubic(sea_mirror[1], mu), spread = cubic(sea_mirror[2], mu);
    vec4 light = vec4(0.0);
    for (int side = -1; side <= 1; side += 2) {
        float high = clamp(mean + float(side) * spread, 0.01, 0.999);
        vec3 direction = level * sqrt(1.0 - high * high) + high * up;
        light += 0.5 * air_ray(direction, high / camera_nearness, 0.0, 0.0).light;
    }
    return light;
}
#endif

#if defined(AIR) && defined(EARTH_MAPS) && !defined(AIR_INSIDE)
// Of the light that leaves white ground or a white layer at a height, the share that the air scatters into
// a ray to space. A ray that comes in gets as much of its light there on the way of scattering.
//
// from_below : what the air over it reflects of light from below
vec4 scattered_up(float height, vec4 to_space, float mu, vec4 from_below) {
    vec2 place = diffuse_place(height, mu, vec2(textureSize(diffuse_down, 0)));
    vec4 all = to_space + textureLod(diffuse_down, place, 0.0) / mu;
    return max(all * (1.0 - mean_ground * from_below) - to_space, vec4(0.0));
}
#endif

#ifdef AIR
Place place_through(AirRay air, Place place) {
#if defined(EARTH_MAPS) && !defined(AIR_INSIDE)
    // Beyond 60 deg from the zenith as there: no corner of a tile differs much from the next.
    float mu_view = max(dot(place.normal, place.view), 0.5);
    place.light.aloft = (place.light.direct * place.lit + place.light.diffuse) / PI * scattered_up(0.0, air.to_ground, mu_view, air_from_below);
#endif
    place.light.to_ground = air.to_ground;
    place.light.direct *= air.to_ground;
    place.light.diffuse *= air.to_ground;
#if defined(BANDS) && !defined(AIR_INSIDE)
    vec2 mu = vec2(dot(place.normal, sun_direction_itrf.xyz), dot(place.normal, place.view));
    vec4 twice = past_twice(0.0, mu.x, mu.y);
    place.light.direct *= twice;
    place.light.diffuse *= twice;
#endif
#ifdef EARTH_MAPS
#ifdef AIR_INSIDE
    vec4 mirrored = sky_in_the_sea(place);
#ifdef NIGHT
    mirrored += glow_irradiance / PI * nightfall(dot(place.normal, sun_direction_itrf.xyz));
#endif
    place.light.sky = mix(place.light.diffuse / PI, mirrored * air.to_ground, exp(-camera_height / SAME_SKY_KM));
#endif
#ifdef TOWERS
    float mu_layer = layer_km > cloud_km ? layer_mu : mu_at(cloud_km, air.mu_ground, 0.0);
    AirRay over = air_before_at(air, max(layer_km, cloud_km), mu_layer);
#else
    AirRay over = air_before(air, cloud_km);
#endif
#ifndef AIR_INSIDE
    vec4 above = air_from_below * (1.0 - over.to_ground) / max(1.0 - air.to_ground, 1e-6);
    place.light.aloft_high = place.light.white * scattered_up(layer_km, over.to_ground, mu_view, above);
#endif
    place.light.white *= over.to_ground;
    place.light.sunny *= over.to_ground;
#ifdef BANDS
    place.light.white_high *= air_before(air, HIGH_CLOUD_KM).to_ground;
#ifndef AIR_INSIDE
    place.light.white *= past_twice(layer_km, mu.x, mu.y);
    place.light.sunny *= past_twice(layer_km, mu.x, mu.y);
    place.light.white_high *= past_twice(HIGH_CLOUD_KM, mu.x, mu.y);
#endif
#endif
    place.light.beneath = air.light - over.light;
#endif
    return place;
}
#endif
