// The Earth and space behind spacecraft in the thermal infrared: band radiance as in thermal/planck.glsl,
// and zeros where the resolve pass has the spacecraft's temperature and share.
//
// Climate and air as in simgl/physics/earth_infrared.py; clouds where the visible image has them.
#include "block/planet"
#include "block/infraredearth"
#include "common/constants.glsl"
#include "common/coverage.glsl"
#include "planet/ray.glsl"
#include "thermal/planck.glsl"
#ifdef EARTH_MAPS
#include "planet/cloud.glsl"
#include "planet/puffs.glsl"

uniform sampler2D shore_map;     // distance to the shore
uniform sampler2D weather_map;   // share of cloud, thickness code, thin high cloud, kind
#endif

out vec4 seen;

// Of the ground [K]; land : share of land, which warms up and cools down by day more than water.
float ground_temperature(vec3 n, float land) {
    vec3 sun = sun_direction_itrf.xyz;
    float level = max(length(n.xy) * length(sun.xy), 1e-6);
    // Hours after noon as an angle, sine and cosine.
    vec2 hour = vec2(sun.x * n.y - sun.y * n.x, dot(sun.xy, n.xy)) / level;
    float swing = dot(hour, vec2(sin(warmest_hour), cos(warmest_hour)));
    float zonal = mean_temperature + 0.5 * second_harmonic * (3.0 * n.z * n.z - 1.0) + season * n.z;
    return zonal + mix(sea_swing, land_swing, land) * length(n.xy) * swing;
}

// Of the air's depth at zenith what a path has that leaves the ground at a cosine: an exponential layer
// around a sphere, exact along the vertical and along the horizon.
float air_mass(float cosine) {
    return inversesqrt(cosine * cosine + 1.0 / (grazing_mass * grazing_mass));
}

void main() {
    Ray ray = ray_through(gl_FragCoord.xy);
    bool ahead = ray.od < 0.0;
    float on_earth = ahead ? coverage(ray.discriminant) : 0.0;
    float root = covered_root(max(ray.discriminant, 0.0));
    float t = ahead ? outside / max(root - ray.od, 1e-30) : 0.0;
    // Where the ray meets the ground; past it, over where it comes nearest.
    if (on_earth <= 0.0) t = -ray.od / ray.dd;
    vec3 n = normalize((camera_in_sphere.xyz + t * ray.d) * sphere_axes.xyz);
    vec3 view = -normalize(ray.d / sphere_axes.xyz);
    float cosine = max(dot(n, view), 0.0), land = mean_land;
    vec2 light = space_radiance;
#ifdef EARTH_MAPS
    vec2 on_map = vec2(atan(n.y, n.x) / (2.0 * PI) + 0.5, 0.5 - atan(n.z, max(length(n.xy), 1e-4)) / PI);
    float footprint = planet_km * t / (intrinsics.x * sqrt(max(cosine, 0.05)));
    vec2 levels = log2(footprint / vec2(map_texel_km, chart_texel_km));
    float shore = textureLod(shore_map, on_map, levels.x - map_halvings.z).r;
    float across_km = clamp(footprint, 0.4, 42.0);
    land = clamp(0.5 - (shore - 128.0 / 255.0) * (255.0 / 6.0) / across_km, 0.0, 1.0);
#endif
    float temperature = ground_temperature(n, land);
    if (on_earth > 0.0) {
        float to_space = exp(-zenith_depth * air_mass(cosine));
        vec2 below = mix(black_body(temperature - air_colder), black_body(temperature), to_space);
#ifdef EARTH_MAPS
        // Clouds absorb half of what they scatter in visible light.
        vec4 weather = textureLod(weather_map, on_map, levels.x - weather_halvings);
        float halving = chart_level(max(levels.y, 0.0));
        vec4 kinds = cloud_kinds(weather.w), shares = kinds * kinds;
        float noise = clouds_noise(spot_on(on_map, n), halving, kinds);
        float resolved = dot(shares, cloud_variance[int(halving)]);
        Broken broken = broken_up(weather.x, resolved, cloud_softness(shares));
        float mu = max(cosine, 0.1);
        float opaque = 1.0 - exp(-0.5 * cloud_thickness(weather.y) / mu);
        // Thick clouds are high, and their towers higher.
        float top_km = cloud_km * max(0.6 + 0.8 * weather.y + 0.15 * (noise - broken.mean), 0.2);
        below = mix(below, black_body(temperature - lapse * top_km), opaque * cloud_cover(broken, noise));
        float thin = high_cloud_thickness * weather.z;
        below = mix(below, black_body(temperature - lapse * high_cloud_km), 1.0 - exp(-0.5 * thin / mu));
#endif
        below += sunlight_reflected * max(dot(n, sun_direction_itrf.xyz), 0.0);
        light = mix(light, below, on_earth);
    }
    if (on_earth < 1.0 && ahead && zenith_depth > 0.0) {
        // The limb: a path that comes no lower than this over the ground [km].
        float height = planet_km * max(sqrt(max(1.0 - ray.discriminant / ray.dd, 0.0)) - 1.0, 0.0);
        float depth = 2.0 * grazing_mass * zenith_depth * exp(-height / air_scale_km);
        float at = max(temperature - air_colder - lapse * height, coldest_air);
        light += (1.0 - on_earth) * (1.0 - exp(-depth)) * (black_body(at) - space_radiance);
    }
    seen = vec4(light, 0.0, 0.0);
}
