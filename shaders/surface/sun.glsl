#include "block/craft"
#include "block/shadow"
#include "common/sun.glsl"
#include "surface/material.glsl"
#include "surface/shadow.glsl"

// The whole map, and right of it the close one where there is one.
uniform sampler2D sun_depths;
uniform sampler2D sun_behind;
uniform sampler2D sun_tops;

// Numbers 0..1 that spread evenly over any neighbourhood of samples, after the plastic number's
// relatives (M. Roberts 2018).
vec2 evenly_spread(vec2 sample_index) {
    return fract(0.5 + vec2(dot(sample_index, vec2(0.7548776662, 0.5698402910)),
                            dot(sample_index, vec2(0.8566748838, 0.7338918566))));
}

// Share of the sunlight that reaches a surface past the casters, per band.
vec4 sunlit(Surface s) {
    vec3 wi = sun_direction.xyz;
    // Both maps: edge of a texel, top, depth, inset; size, column, column of the bounds.
    vec4 frame = shadow_frame[0], sheet = shadow_sheet[0];
    vec3 here = (shadow_from_body[0] * vec4(s.body, 1.0)).xyz;
    vec3 closer = (shadow_from_body[1] * vec4(s.body, 1.0)).xyz;
    vec2 inside = min(closer.xy, shadow_sheet[1].x - closer.xy);
    if (min(inside.x, inside.y) > shadow_frame[1].w) {
        frame = shadow_frame[1];
        sheet = shadow_sheet[1];
        here = closer;
    }
    // The smooth surface that the normals stand for lies above its facets by the sagitta of an edge;
    // a quarter of a texel lifts the receiver there. Facets that already face away use its plane.
    vec3 n = mat3(light_from_camera) * s.plain_n;
    vec3 plane = dot(s.facet, wi) > 0.0 ? mat3(light_from_camera) * s.facet : n;
    here += n * vec3(0.25, 0.25, 0.25 * frame.x);
    vec2 slope = -plane.xy / max(plane.z, 1e-9) * frame.x;
    vec2 turn = evenly_spread(floor(gl_FragCoord.xy));
    SunMap map = SunMap(frame.x, frame.y, frame.z, int(sheet.x), int(sheet.y), int(sheet.z),
                        shadow_solid > 0.5, int(shadow_taps));
    return unshaded(sun_depths, sun_behind, sun_tops, map, here, slope, sheet.w, sun_limb_u,
                    sun_limb_v, turn);
}

// Radiance of the sunlight that a surface turns to the viewer [W m-2 sr-1].
vec4 sun_light(Surface s) {
    vec3 wi = sun_direction.xyz;
    float facing = disc_cosine(dot(s.n, wi), sun_angular_radius);
    facing *= past_relief(s, wi);
    vec4 light = vec4(0.0);
    // One turn or none: see surface/shadow.glsl.
    for (int once = 0; once < int(facing > 0.0); ++once) {
        vec4 lit = vec4(1.0);
        // With the Sun's centre below the surface's own horizon disc_cosine has cut the disc
        // already, and no map along the centre's rays can tell more. At most 0.1 % of the full
        // sunlight is left there.
        for (int above = 0; above < int(dot(s.n, wi) > 0.0); ++above) lit = sunlit(s);
        light = reflection(s, wi, sun_angular_radius) * sun_irradiance * facing * lit;
    }
    return light;
}
