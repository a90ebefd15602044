#include "block/spacecraft"
#include "common/sun.glsl"
#include "common/texels.glsl"
#include "gbuffer/page_places.glsl"
#include "surface/material.glsl"
#include "surface/unknown_sunlight.glsl"

// Share of the sunlight that passes the casters, per band; negative where it was looked for afterwards:
// then points fill one square of 4 x 4 texels after the other (surface/sunlight.frag).
uniform sampler2D sunlight;
uniform sampler2D searched_sunlight;
// Of each page: from bit 4 on how many points come before its own, below it which of its points; of
// those that were searched, and of those near casters.
uniform usampler2D searched_pages;

// The share at a shading point.
vec4 sunlight_at(ivec2 at) {
    vec4 lit = read_texel(sunlight, at);
    if (lit.x < 0.0) {
        uvec2 pages = read_texel(searched_pages, entry_of_point(at)).rg;
        uint page = lit.x == SEARCH_TELLS ? pages.r : pages.g;
        int index = listed_index(page, at);
        int square = index >> 4;
        ivec2 place = 4 * ivec2(square & (SQUARES - 1), square / SQUARES);
        lit = read_texel(searched_sunlight, place + ivec2(index & 3, (index >> 2) & 3));
    }
    return lit;
}

// Radiance of sunlight from a direction that a surface turns to the viewer [W m-2 sr-1].
//
// lit : the share of it that passes the casters, per band
vec4 sun_light_from(Surface s, vec3 wi, vec4 lit) {
    float facing = disc_cosine(dot(s.n, wi), sun_angular_radius) * past_relief(s, wi);
    // With the Sun's centre below the surface's own horizon disc_cosine has cut the disc already, and
    // no map along the centre's rays can tell more. At most 0.1 % of the full sunlight is left there.
    if (dot(s.n, wi) <= 0.0) lit = vec4(1.0);
    vec4 irradiance = sun_irradiance * facing * lit, light = vec4(0.0);
    if (any(greaterThan(irradiance, vec4(0.0)))) {
        Disc disc = Disc(wi, sun_angular_radius, sun_limb_u, sun_limb_v);
        light = reflection(s, disc) * irradiance;
    }
    return light;
}

// Radiance of the sunlight that a surface turns to the viewer [W m-2 sr-1].
vec4 sun_light(Surface s, vec4 lit) {
    vec3 wi = sun_direction.xyz;
#ifdef MOVING
    wi = light_at(wi, s.time);
#endif
#ifdef SPREAD_LIGHT
    vec4 light = vec4(0.0);
    Times times = spread_times(narrowest_lobe(s), s.place);
    float left = times.count;
    do {
        float time = spread_time(left, times);
        s.wo = spread_viewer(s.place, time);
        light += sun_light_from(s, spread_light(wi, time), lit);
    } while (--left > 0.0);
    return light / times.count;
#else
    return sun_light_from(s, wi, lit);
#endif
}
