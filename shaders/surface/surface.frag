// Radiance of a spacecraft's surface [W m-2 sr-1]: the sum over all light that reaches it, or each
// light apart.
// A file is included once: here, since others include this one only where they are wanted.
#include "common/texels.glsl"
#include "common/sun.glsl"
#include "surface/gbuffer.glsl"
#include "surface/bounce.glsl"
#ifdef SUNLIT
#include "surface/sun.glsl"
#endif
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
// In each part of the times over which light is spread (common/light_spread.glsl).
layout(location = 0) out vec4 radiance[LIGHT_PARTS];
#endif

// Radiance of each light [W m-2 sr-1]; of direct light in each part of the times.
struct Lights {
    vec4 sun[LIGHT_PARTS], lamps[LIGHT_PARTS], earth, other_surfaces;
};

Lights no_lights() {
    Lights none;
    none.earth = none.other_surfaces = vec4(0.0);
    for (int part = 0; part < LIGHT_PARTS; ++part) none.sun[part] = none.lamps[part] = vec4(0.0);
    return none;
}

// sunlit : share of the sunlight that reaches the surface, per band; lit : of each lamp's light
Lights lights_of(Surface s, vec4 sunlit, vec4 lit) {
    Lights light = no_lights();
    for (int part = 0; part < LIGHT_PARTS; ++part) {
#ifdef SPREAD_LIGHT
        light_part = part;
#endif
#ifdef SUNLIT
        light.sun[part] = sun_light(s, sunlit);
#endif
#ifdef LAMPS
        light.lamps[part] = lamp_light(s, lit);
#endif
    }
#if defined(SKY) || defined(INTERREFLECTION) || defined(GLOSSY)
    Albedo albedo = albedo_of(s);
#endif
#ifdef SKY
    light.earth = earth_light(s, albedo);
#endif
#if defined(INTERREFLECTION) || defined(GLOSSY)
    light.other_surfaces = bounced_light(s, albedo);
#endif
    return light;
}

// Whether a point is drawn here: those of layered materials with LAYERED, the others without. llvmpipe
// works out squares of points whole, and would run loops as long as a point asks for that is not drawn.
bool is_drawn(float label) {
#ifdef LAYERED
    const bool LAYERS_DRAWN = true;
#else
    const bool LAYERS_DRAWN = false;
#endif
    return uint(label) / 16384u == instance && is_layered(material_of(label)) == LAYERS_DRAWN;
}

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    Surface s = gbuffer_surface(at);
#ifdef GLOSSY
    s = with_seen_lobes(s, at);
#endif
    vec4 sunlit = vec4(1.0), lit = vec4(1.0);
#ifdef SUNLIT
    sunlit = sunlight_at(at);
#endif
#if defined(LAMPS) || defined(LAYERED)
    float label = read_texel(gbuffer_position, at).w;
    bool drawn = is_drawn(label);
#endif
#ifdef LAMPS
    if (drawn) lit = lamps_lit(s);
#endif
#ifdef LAYERED
    // Patterns are finer than a cell: the mean over its samples. What has none is shaded once.
    uint material = material_of(label);
    uint group = group_of(at);
    vec2 middle = point_of(group);
    bool patterned = drawn && is_patterned(material);
    uint left = patterned ? group : lowest_of(group);
    float share = 1.0 / float(samples_of(left));
    Pattern pattern = pattern_of(s, material);
    Lights light = no_lights();
    do {
        vec2 offset = vec2(next_texel(left)) + 0.5 - middle;
        if (!patterned) offset = vec2(0.0);
        Lights one = lights_of(sample_surface(s, material, pattern, offset), sunlit, lit);
        light.earth += share * one.earth;
        light.other_surfaces += share * one.other_surfaces;
        for (int part = 0; part < LIGHT_PARTS; ++part) {
            light.sun[part] += share * one.sun[part];
            light.lamps[part] += share * one.lamps[part];
        }
    } while (left != 0u);
#else
    Lights light = lights_of(s, sunlit, lit);
#endif
#ifdef AIR_BEFORE
    // What the air adds counts as the Earth's light.
    light.earth = light.earth * air_transmittance + air_light;
    light.other_surfaces *= air_transmittance;
    s.emission *= air_transmittance;
    for (int part = 0; part < LIGHT_PARTS; ++part) {
        light.sun[part] *= air_transmittance;
        light.lamps[part] *= air_transmittance;
    }
#endif
#ifdef BY_LIGHT
    radiance[0] = light.sun[0];
    radiance[1] = light.earth;
    radiance[2] = light.other_surfaces;
    radiance[3] = light.lamps[0];
    radiance[4] = s.emission;
#else
    for (int part = 0; part < LIGHT_PARTS; ++part)
        radiance[part] = light.sun[part] + s.emission + light.earth + light.other_surfaces + light.lamps[part];
#endif
}
