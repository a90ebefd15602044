#include "block/spacecraft"
#include "common/sun.glsl"
#include "surface/material.glsl"

// Share of the sunlight that passes the casters, per band (surface/sunlight.frag).
uniform sampler2D sunlight;

// Radiance of the sunlight that a surface turns to the viewer [W m-2 sr-1].
vec4 sun_light(Surface s, ivec2 at) {
    vec3 wi = sun_direction.xyz;
    float facing = disc_cosine(dot(s.n, wi), sun_angular_radius) * past_relief(s, wi);
    // With the Sun's centre below the surface's own horizon disc_cosine has cut the disc already, and
    // no map along the centre's rays can tell more. At most 0.1 % of the full sunlight is left there.
    vec4 lit = dot(s.n, wi) > 0.0 ? texelFetch(sunlight, at, 0) : vec4(1.0);
    vec4 irradiance = sun_irradiance * facing * lit, light = vec4(0.0);
    WHEN(any(greaterThan(irradiance, vec4(0.0)))) {
        Disc disc = Disc(wi, sun_angular_radius, sun_limb_u, sun_limb_v);
        light = reflection(s, disc) * irradiance;
    }
    return light;
}
