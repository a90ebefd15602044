// Radiance of a spacecraft's surface [W m-2 sr-1], the sum over all light that reaches it.
#include "surface/sun.glsl"

in vec3 position;
in vec3 normal;
in vec3 light_clip;
flat in uint material;

out vec4 radiance;

void main() {
    Surface s = surface_at(position, normal, material);
    radiance = sun_light(s, light_clip);
}
