// Corners of tiles that lie on the ground and see it change evenly: what planet.frag finds for every
// pixel, found here.
#include "planet/place.glsl"

in vec2 corner;

out Place seen;
out vec4 light;

void main() {
    gl_Position = vec4(corner * area.zw - 1.0, 0.0, 1.0);
    vec3 ray = normalize(vec3((area.xy + corner - intrinsics.zw) / intrinsics.xy, 1.0));
    vec3 d = mat3(sphere_from_camera) * ray;
    float dd = dot(d, d), od = dot(camera_in_sphere.xyz, d);
    float discriminant = max(od * od - dd * outside, 0.0);
    float root = sqrt(discriminant), stretch = sqrt(dd);
    seen = place_at(d, outside / (root - od), max(root / stretch, 1e-3));
    AirRay air = air_ray(d / stretch, od / stretch, discriminant / dd, 1.0);
    seen = place_through(air, seen);
    light = air.light;
}
