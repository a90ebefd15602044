// Airglow: even layers of the air that shine by themselves at night, one a band [W m-2 sr-1].
#include "block/planet"
#include "common/constants.glsl"
#include "planet/night.glsl"
#include "planet/ray.glsl"
#ifdef AIR
#include "common/coverage.glsl"
#include "air/air.glsl"
#endif

out vec4 radiance;

// Half a ray's way within a sphere for each band, in its own steps, 0 where it misses: the mean over
// the pixel, over which the root's argument is nearly linear. The layers are thinner than a pixel
// from afar and in the sky around a spacecraft.
vec4 half_way(Ray ray, vec4 beyond_sphere) {
    vec4 value = ray.od * ray.od - ray.dd * beyond_sphere;
    vec4 x = dFdx(value), y = dFdy(value);
    vec4 half_step = 0.5 * sqrt(x * x + y * y);
    vec4 low = max(value - half_step, 0.0), high = max(value + half_step, 0.0);
    // (high^1.5 - low^1.5) / (3 half_step), without its cancellation.
    vec4 a = sqrt(low), b = sqrt(high);
    vec4 inside = clamp((value + half_step) / max(2.0 * half_step, 1e-30), 0.0, 1.0);
    vec4 mean = 2.0 / 3.0 * (low + a * b + high) / max(a + b, 1e-30);
    return inside * mean / ray.dd;
}

// One wave's share of the light over its mean: smoothed by the pixel and by the way through the layer, of
// which so many km lie along the ground.
float wave(vec3 place, vec3 along, float length_km, float way_km) {
    float k = 2.0 * PI / length_km, phase = k * dot(along, place);
    float pixel = fwidth(phase), way = 0.5 * k * way_km;
    return 1.4142136 * sin(phase) * exp(-0.25 * pixel * pixel) / (1.0 + way * way);
}

// Gravity waves in the layers: their variance is 1 where a pixel and the way resolve them.
float waves(vec3 up, float way_km) {
    vec3 place = planet_km * up;
    float wide = 0.55 * wave(place, vec3(0.267, 0.535, 0.802), 1100.0, way_km)
               + 0.45 * wave(place, vec3(-0.745, 0.596, 0.298), 640.0, way_km)
               + 0.35 * wave(place, vec3(0.707, -0.424, 0.566), 370.0, way_km);
    // Trains of bands 30 to 60 km apart.
    float trains = 0.5 + 0.5 * sin(2.0 * PI / 900.0 * dot(vec3(0.6, -0.64, 0.48), place) + 2.0 * wide);
    float bands = 0.8 * wave(place + 30.0 * wide, vec3(0.811, 0.324, 0.487), 58.0, way_km)
                + 0.6 * wave(place + 30.0 * wide, vec3(0.365, -0.913, -0.183), 33.0, way_km);
    return wide + trains * bands;
}

void main() {
    Ray ray = ray_through(gl_FragCoord.xy);
    vec4 bottom = half_way(ray, glow_outside[0]), top = half_way(ray, glow_outside[1]);
    float lowest = -ray.od / ray.dd, stretch = sqrt(ray.dd);
    // Nothing of it lies behind the camera.
    vec4 before = max(lowest - bottom, 0.0) - max(lowest - top, 0.0);
    vec4 behind = max(lowest + top, 0.0) - max(lowest + bottom, 0.0);
#ifdef AIR
    // Of the far passage, what the air and the ground before it leave.
    float on_earth = ray.od < 0.0 ? coverage(ray.discriminant) : 0.0;
    AirRay air = air_ray(ray.d / stretch, ray.od / stretch, ray.discriminant / ray.dd, on_earth);
    vec4 path = before + behind * (1.0 - on_earth) * air.to_space;
    bool inside = glow_outside[1].y < 0.0;
    float place = inside ? lowest + top.y : lowest - on_earth * top.y;
#else
    vec4 path = before;
    float place = lowest - top.y;
#endif
    vec3 up = normalize((camera_in_sphere.xyz + place * ray.d) * sphere_axes.xyz);
    radiance = glow * path * stretch * nightfall(dot(up, sun_direction_itrf.xyz));
    if (glow_waves > 0.0) {
        float way_km = max(path.y * stretch * planet_km - glow_depth_km, 0.0);
        radiance *= max(1.0 + glow_waves * waves(up, way_km), 0.0);
    }
}
