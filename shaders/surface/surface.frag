// Radiance of a spacecraft's surface [W m-2 sr-1]: the sum over all light that reaches it, or each
// light apart.
#include "surface/gbuffer.glsl"
#include "surface/sun.glsl"
#include "surface/bounce.glsl"
#ifdef SKY
#include "surface/earth.glsl"
#endif
#ifdef LAMPS
#include "surface/lamp.glsl"
#endif

#ifdef BY_LIGHT
// In the order of LIGHTS in simgl/passes/surface.py.
layout(location = 0) out vec4 radiance[5];
#else
layout(location = 0) out vec4 radiance;
#endif

// Of a spacecraft that has layered materials, those are drawn with LAYERED, the others with PLAIN.

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    Surface s = gbuffer_surface(at);
    vec4 sun = sun_light(s, at), earth = vec4(0.0), other_surfaces = vec4(0.0), lamps = vec4(0.0);
#if defined(SKY) || defined(INTERREFLECTION)
    Albedo albedo = albedo_of(s);
#endif
#ifdef SKY
    earth = earth_light(s, albedo) * s.earth_share;
#endif
#ifdef INTERREFLECTION
    other_surfaces = bounced_light(s, albedo);
#endif
#ifdef LAMPS
    lamps = lamp_light(s);
#endif
#ifdef AIR_BEFORE
    // What the air adds counts as the Earth's light.
    sun *= air_transmittance;
    earth = earth * air_transmittance + air_light;
    other_surfaces *= air_transmittance;
    lamps *= air_transmittance;
    s.emission *= air_transmittance;
#endif
#ifdef BY_LIGHT
    radiance[0] = sun;
    radiance[1] = earth;
    radiance[2] = other_surfaces;
    radiance[3] = lamps;
    radiance[4] = s.emission;
#else
    radiance = sun + s.emission + earth + other_surfaces + lamps;
#endif
#ifdef PLAIN
    if (is_layered(material_of(texelFetch(gbuffer_position, at, 0).w))) discard;
#endif
}
