// Radiance of a spacecraft's surface [W m-2 sr-1], the sum over all light that reaches it.
#include "surface/sun.glsl"
#include "surface/bounce.glsl"
#ifdef SKY
#include "surface/earth.glsl"
#endif
#ifdef LAMPS
#include "surface/lamp.glsl"
#endif

in vec3 position;
in vec3 normal;
in vec3 body_position;
flat in uint material;

out vec4 radiance;

void main() {
    Surface s = surface_at(position, body_position, normal, material);
    radiance = sun_light(s) + s.emission;
#if defined(SKY) || defined(EXCHANGE)
    Albedo albedo = albedo_of(s);
#endif
#ifdef SKY
    radiance += earth_light(s, albedo) * past_the_craft();
#endif
#ifdef EXCHANGE
    radiance += bounced_light(albedo);
#endif
#ifdef LAMPS
    radiance += lamp_light(s);
#endif
#ifdef CUT_OUT
    if (!s.there) discard;
#endif
}
