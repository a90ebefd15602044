// Earth and Sun behind the spacecraft, radiance [W m-2 sr-1], a mean over the pixel at the limbs.
#include "block/planet"
#include "common/coverage.glsl"
#include "planet/disc.glsl"
#include "planet/ground.glsl"
#ifdef AIR
#include "air/air.glsl"
#endif

out vec4 radiance;

// Unit direction of a pixel in camera axes.
vec3 pixel_ray(vec2 pixel) {
    return normalize(vec3((pixel - intrinsics.zw) / intrinsics.xy, 1.0));
}

void main() {
    vec3 ray = pixel_ray(gl_FragCoord.xy);
    float off_sun = atan(length(cross(ray, sun_direction.xyz)), dot(ray, sun_direction.xyz));
    vec4 sky = sun_disc(off_sun);

    // In sphere space |o + t d| = 1: t^2 dd + 2 t od + (oo - 1) = 0, oo - 1 taken in float64 outside.
    vec3 o = camera_in_sphere.xyz;
    vec3 d = mat3(sphere_from_camera) * ray;
    float dd = dot(d, d), od = dot(o, d);
    float discriminant = od * od - dd * outside;
    float on_earth = has_earth > 0.5 ? coverage(discriminant) : 0.0;
    if (od >= 0.0) on_earth = 0.0;
#ifdef AIR
    float stretch = sqrt(dd);
    AirRay air = air_ray(d / stretch, od / stretch, discriminant / dd, on_earth);
    sky = sky * air.to_space;
#endif
    vec4 earth = vec4(0.0);
    if (on_earth > 0.0) {
        float root = sqrt(max(discriminant, 0.0));
        float t = outside / (root - od);
        vec3 ground = o + t * d;
        // The gradient of the sphere's equation, stretched back, is the ellipsoid's normal (ITRF).
        vec3 normal = normalize(ground * sphere_axes.xyz);
        float slant = max(root / sqrt(dd), 1e-3);
        float footprint = t / (intrinsics.x * sqrt(slant));
        earth = ground_radiance(normal, footprint);
#ifdef AIR
        earth = earth * air.to_ground;
#endif
    }
    radiance = mix(sky, earth, on_earth);
#ifdef AIR
    radiance += air.light;
#endif
}
