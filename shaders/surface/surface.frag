// Radiance of a spacecraft's surface [W m-2 sr-1]: the sum over all light that reaches it, or each
// light apart.
// A file is included once: here, since others include this one only where they are wanted.
#include "common/texels.glsl"
#include "surface/gbuffer.glsl"
#include "surface/sun.glsl"
#include "surface/bounce.glsl"
#ifdef SKY
#include "surface/earth.glsl"
#endif
#ifdef LAMPS
#include "surface/lamp.glsl"
#endif
#ifdef GLOSSY
#include "surface/seen_lobes.glsl"
#endif

#ifdef BY_LIGHT
// In the order of LIGHTS in simgl/passes/surface.py.
layout(location = 0) out vec4 radiance[5];
#else
layout(location = 0) out vec4 radiance;
#endif

// Radiance of each light [W m-2 sr-1].
struct Lights {
    vec4 sun, earth, other_surfaces, lamps;
};

// sunlit : share of the sunlight that reaches the surface, per band; lit : of each lamp's light
Lights lights_of(Surface s, vec4 sunlit, vec4 lit) {
    Lights light = Lights(sun_light(s, sunlit), vec4(0.0), vec4(0.0), vec4(0.0));
#if defined(SKY) || defined(INTERREFLECTION) || defined(GLOSSY)
    Albedo albedo = albedo_of(s);
#endif
#ifdef SKY
    light.earth = earth_light(s, albedo);
#endif
#if defined(INTERREFLECTION) || defined(GLOSSY)
    light.other_surfaces = bounced_light(s, albedo);
#endif
#ifdef LAMPS
    light.lamps = lamp_light(s, lit);
#endif
    return light;
}

// Points of layered materials are drawn with LAYERED, the others without.

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    Surface s = gbuffer_surface(at);
#ifdef GLOSSY
    s = with_seen_lobes(s, at);
#endif
    vec4 sunlit = sunlight_at(at), lit = vec4(1.0);
#ifdef LAMPS
    lit = lamps_lit(s);
#endif
#ifdef LAYERED
    // Patterns are finer than a cell: the mean over its samples. What has none is shaded once.
    uint material = material_of(texelFetch(gbuffer_position, at, 0).w);
    uint group = group_of(at);
    vec2 middle = point_of(group);
    bool patterned = is_patterned(material);
    uint left = patterned ? group : lowest_of(group);
    float share = 1.0 / float(samples_of(left));
    Pattern pattern = pattern_of(s, material);
    Lights light = Lights(vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0));
    do {
        vec2 offset = vec2(next_texel(left)) + 0.5 - middle;
        if (!patterned) offset = vec2(0.0);
        Lights one = lights_of(sample_surface(s, material, pattern, offset), sunlit, lit);
        light.sun += share * one.sun;
        light.earth += share * one.earth;
        light.other_surfaces += share * one.other_surfaces;
        light.lamps += share * one.lamps;
    } while (left != 0u);
#else
    Lights light = lights_of(s, sunlit, lit);
#endif
#ifdef AIR_BEFORE
    // What the air adds counts as the Earth's light.
    light.sun *= air_transmittance;
    light.earth = light.earth * air_transmittance + air_light;
    light.other_surfaces *= air_transmittance;
    light.lamps *= air_transmittance;
    s.emission *= air_transmittance;
#endif
#ifdef BY_LIGHT
    radiance[0] = light.sun;
    radiance[1] = light.earth;
    radiance[2] = light.other_surfaces;
    radiance[3] = light.lamps;
    radiance[4] = s.emission;
#else
    radiance = light.sun + s.emission + light.earth + light.other_surfaces + light.lamps;
#endif
}
