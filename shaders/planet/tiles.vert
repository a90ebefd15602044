// Corners of tiles that lie on the ground and see it change evenly: what planet.frag finds for every
// pixel, found here.
#include "planet/place.glsl"
#include "planet/ray.glsl"

in vec2 corner;

noperspective out Place seen;
noperspective out vec4 light;

void main() {
    gl_Position = vec4(corner * area.zw - 1.0, 0.0, 1.0);
    Ray ray = ray_through(area.xy + corner);
    float discriminant = max(ray.discriminant, 0.0);
    float root = sqrt(discriminant), stretch = sqrt(ray.dd);
    float cloud_t = clouds_t(ray, clouds_discriminant(ray));
    seen = place_at(ray.d, outside / (root - ray.od), cloud_t, max(root / stretch, 1e-3));
    AirRay air = air_ray(ray.d / stretch, ray.od / stretch, discriminant / ray.dd, 1.0);
    seen = place_through(air, seen);
    light = air.light;
}
