// The cheapest pass that draws a planet: the pixel's ray, and where it meets a sphere.
#include "planet/ray.glsl"

out vec4 radiance;

void main() {
    Ray ray = ray_through(gl_FragCoord.xy);
    float root = sqrt(max(ray.discriminant, 0.0));
    float t = outside / (root - ray.od);
    bool hit = ray.od < 0.0 && ray.discriminant > 0.0;
    radiance = hit ? vec4(camera_in_sphere.xyz + t * ray.d, t) : vec4(0.0);
}
