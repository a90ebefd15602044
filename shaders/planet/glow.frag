// Airglow: even layers of the air that shine by themselves at night, one a band [W m-2 sr-1].
#include "block/planet"
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
}
