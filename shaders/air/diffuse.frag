// The radiance inside the air on rings of constant elevation: harmonics in azimuth from the Sun, summed
// over a ring. Of sunlight scattered or reflected once (WITHOUT_DIFFUSE), of what a given diffuse
// light becomes by one more scattering or reflection (WITHOUT_SUN), or of what the aerosol scatters
// once, weighted by the sharp part of its phase function (AUREOLE).
//
// Columns are angles of the Sun, rows heights, and the rings follow each other downwards.
#include "air/march.glsl"
#include "block/airtable"
#include "common/sun.glsl"

#ifdef WITHOUT_SUN
uniform sampler2D diffuse_down;
#endif

layout(location = 0) out vec4 ring_0;
layout(location = 1) out vec4 ring_1;
layout(location = 2) out vec4 ring_2;

// Radiance of the ground under that light.
vec4 ground_light(float mu_sun) {
#ifdef WITHOUT_SUN
    vec2 place = diffuse_place(0.0, mu_sun, vec2(textureSize(diffuse_down, 0)));
    vec4 irradiance = textureLod(diffuse_down, place, 0.0);
#else
    vec4 irradiance = transmittance_to_space(0.0, mu_sun) * disc_cosine(mu_sun, sun_half_angle);
#endif
    return mean_albedo / PI * irradiance;
}

void main() {
    int ring = int(gl_FragCoord.y) / int(table_size.y);
    vec2 texel = vec2(gl_FragCoord.x, gl_FragCoord.y - float(ring) * table_size.y);
    vec2 place = diffuse_texel(texel, table_size);
    float height = place.x, mu_sun = place.y;
    float sine_sun = sqrt(max(1.0 - mu_sun * mu_sun, 0.0));
    float r = ground_radius + height, c = above_ground(height);
    float horizon = -sqrt(c) / r;
    bool ground = ring >= ABOVE;
    float root = nodes[ring].x;
    float mu = clamp(horizon + ((ground ? -1.0 : 1.0) - horizon) * root * root, -1.0, 1.0);
    float sine = sqrt(max(1.0 - mu * mu, 0.0));
    float b = r * mu;
    float d = b * b - c;
    d = ground ? max(d, 0.0) : min(d, 0.0);
    ring_0 = ring_1 = ring_2 = vec4(0.0);
    for (int k = 0; k < AROUND; ++k) {
        // The field is even about the Sun's vertical plane: the middles of half a circle.
        float azimuth = PI * (float(k) + 0.5) / float(AROUND);
        float nu = mu * mu_sun + sine * sine_sun * cos(azimuth);
        Stretch way = stretch_of_ray(c, r, b, d, mu_sun, nu, ground);
        Passage air = march(way, STEPS);
        vec4 light = air.light;
#ifdef AUREOLE
        vec4 g = aerosol_asymmetry;
        vec4 smooth_part = 1.0 + g * (3.0 * nu + g * 5.0 * (1.5 * nu * nu - 0.5));
        light *= aerosol_phase(nu) - smooth_part / (4.0 * PI);
#else
        if (ground) light += air.transmittance * ground_light(way.mu_sun);
#endif
        light *= 2.0 * PI / float(AROUND);
        ring_0 += light;
        ring_1 += light * cos(azimuth);
        ring_2 += light * cos(2.0 * azimuth);
    }
}
