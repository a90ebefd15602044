// Air before space, and no ground.
#include "planet/ray.glsl"
#include "air/air.glsl"

layout(location = 0, index = 0) out vec4 radiance;
layout(location = 0, index = 1) out vec4 beyond;

void main() {
    Ray ray = ray_through(gl_FragCoord.xy);
    float stretch = sqrt(ray.dd);
    AirRay air = air_ray(ray.d / stretch, ray.od / stretch, ray.discriminant / ray.dd, 0.0);
    radiance = air.light;
    beyond = air.to_space;
}
