// Moments of the radiance at a height and angle of the Sun, and its irradiance from above: of sunlight
// scattered or reflected once (WITHOUT_DIFFUSE), or what a given diffuse light becomes by one more
// scattering or reflection (WITHOUT_SUN).
#include "air/march.glsl"
#include "block/airtable"
#include "common/sun.glsl"

#ifdef WITHOUT_SUN
uniform sampler2D diffuse_down;
#endif

layout(location = 0) out vec4 moment_j;
layout(location = 1) out vec4 moment_fx;
layout(location = 2) out vec4 moment_fz;
layout(location = 3) out vec4 moment_mxx;
layout(location = 4) out vec4 moment_mzz;
layout(location = 5) out vec4 moment_mxz;
layout(location = 6) out vec4 down;

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
    vec2 place = diffuse_texel(gl_FragCoord.xy, table_size);
    float height = place.x, mu_sun = place.y;
    float sine_sun = sqrt(max(1.0 - mu_sun * mu_sun, 0.0));
    float r = ground_radius + height, c = above_ground(height);
    float horizon = -sqrt(c) / r;
    moment_j = moment_fx = moment_fz = moment_mxx = moment_mzz = moment_mxz = down = vec4(0.0);
    // Gauss' points above and below the horizon, crowded at it, where the sky changes fastest.
    for (int i = 0; i < ABOVE + BELOW; ++i) {
        bool ground = i >= ABOVE;
        vec2 node = nodes[i].xy;
        float span = ground ? -1.0 - horizon : 1.0 - horizon;
        float mu = clamp(horizon + span * node.x * node.x, -1.0, 1.0);
        float ring = 2.0 * abs(span) * node.x * node.y * 2.0 * PI / float(AROUND);
        float sine = sqrt(max(1.0 - mu * mu, 0.0));
        float b = r * mu;
        float d = b * b - c;
        d = ground ? max(d, 0.0) : min(d, 0.0);
        for (int k = 0; k < AROUND; ++k) {
            // The field is even about the Sun's vertical plane: half a circle, its middles.
            float x = sine * cos(PI * (float(k) + 0.5) / float(AROUND));
            float nu = mu * mu_sun + x * sine_sun;
            Stretch way = stretch_of_ray(c, r, b, d, mu_sun, nu, ground);
            Passage air = march(way, STEPS);
            vec4 light = air.light;
            if (ground) light += air.transmittance * ground_light(way.mu_sun);
            light *= ring;
            moment_j += light;
            moment_fx += light * x;
            moment_fz += light * mu;
            moment_mxx += light * x * x;
            moment_mzz += light * mu * mu;
            moment_mxz += light * x * mu;
            down += light * max(mu, 0.0);
        }
    }
}
