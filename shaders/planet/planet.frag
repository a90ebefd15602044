// Earth and air behind the spacecraft, radiance [W m-2 sr-1], a mean over the pixel at the limb, and
// the share of what lies beyond that is seen past them.
#include "block/planet"
#include "common/coverage.glsl"
#include "planet/ground.glsl"

layout(location = 0, index = 0) out vec4 radiance;
layout(location = 0, index = 1) out vec4 beyond;

// Unit direction of a pixel in camera axes.
vec3 pixel_ray(vec2 pixel) {
    return normalize(vec3((pixel - intrinsics.zw) / intrinsics.xy, 1.0));
}

void main() {
    vec3 ray = pixel_ray(gl_FragCoord.xy);
    // In sphere space |o + t d| = 1: t^2 dd + 2 t od + (oo - 1) = 0, oo - 1 taken in float64 outside.
    vec3 o = camera_in_sphere.xyz;
    vec3 d = mat3(sphere_from_camera) * ray;
    float dd = dot(d, d), od = dot(o, d);
    float discriminant = od * od - dd * outside;
    float on_earth = od < 0.0 ? coverage(discriminant) : 0.0;
#ifdef AIR
    float stretch = sqrt(dd);
    AirRay air = air_ray(d / stretch, od / stretch, discriminant / dd, on_earth);
    radiance = air.light;
    beyond = air.to_space * (1.0 - on_earth);
#else
    radiance = vec4(0.0);
    beyond = vec4(1.0 - on_earth);
#endif
    if (on_earth <= 0.0) return;
    float root = sqrt(max(discriminant, 0.0));
    float t = outside / (root - od);
    Place here = place_at(d, t, max(root / sqrt(dd), 1e-3));
#ifdef AIR
    here = place_through(air, here);
#endif
    radiance += on_earth * ground_radiance(here);
}
