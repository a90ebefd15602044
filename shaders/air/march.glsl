// Light scattered into a ray on its way through the air. All in scalars about the ray's lowest
// point, so that float32 is enough at any distance from the Earth's centre.
#include "air/medium.glsl"
#include "air/profile.glsl"
#include "air/transmittance.glsl"
#include "air/diffuse.glsl"

// A stretch of a ray inside the air, measured from its lowest point: where it meets the ground, or
// turns upwards, or begins.
//
// height    : of the lowest point
// mu        : cosine of the view direction from the zenith there
// mu_sun    : cosine of the Sun's direction from the zenith there
// nu        : cosine between the view direction and the Sun's, the same all along
// near, far : from the lowest point to where the stretch begins (<= 0) and ends (>= 0)
struct Stretch {
    float height;
    float mu;
    float mu_sun;
    float nu;
    float near;
    float far;
};

// The part of a camera's ray that lies in the air.
//
// c      : r^2 - ground_radius^2 of the camera, taken in float64 where it comes from
// r, b   : the camera's distance from the Earth's centre, and its product with the ray's cosine
// d      : b^2 - c, greater than 0 where the line meets the ground
// ground : whether the ray does; decided once, by the caller
Stretch stretch_of_ray(float c, float r, float b, float d, float mu_sun, float nu, bool ground) {
    float top = above_ground(air_top);
    if (ground) {
        float root = sqrt(max(d, 0.0));
        float way = c / (root - b), reach = min(c, top);
        float near = -reach / (root + sqrt(root * root + reach));
        return Stretch(0.0, -root / ground_radius, (r * mu_sun + way * nu) / ground_radius, nu, near, 0.0);
    }
    if (b < 0.0) {
        float lowest = sqrt(ground_radius * ground_radius - d);
        float far = sqrt(max(top + d, 0.0));
        return Stretch(max(-d, 0.0) / (ground_radius + lowest), 0.0, (r * mu_sun - b * nu) / lowest, nu,
                       -min(-b, far), far);
    }
    float above = max(top - c, 0.0);
    float height = c / (ground_radius + r);
    return Stretch(height, b / r, mu_sun, nu, 0.0, above / (b + sqrt(b * b + above) + 1e-9));
}

struct Passage {
    vec4 light;
    vec4 transmittance;
};

#ifndef DIFFUSE_CELLS
#define DIFFUSE_CELLS 1
#endif

// A place on a stretch, and the Sun there.
struct March {
    float s;
    float height;
    float mu;
    float mu_sun;
};

// At `s` from the lowest point, whose distance from the Earth's centre is `r0`.
March march_place(Stretch way, float r0, float s) {
    float rise = s * (2.0 * r0 * way.mu + s);
    float r = sqrt(r0 * r0 + rise);
    float height = max(way.height + rise / (r + r0), 0.0);
    float mu_sun = clamp((r0 * way.mu_sun + s * way.nu) / r, -1.0, 1.0);
    return March(s, height, (r0 * way.mu + s) / r, mu_sun);
}

// The march: `steps` cells, crowded quadratically about the lowest point, where the air is dense;
// within a cell the medium is even and its own extinction is integrated. With x = sqrt(|s|) on even
// cells of width w, the middles sum to too much by w^2 / 12 of the source at x = 0 (Euler-Maclaurin);
// reading the source at s = x^2 + w^2 / 12 takes that away. Diffuse light changes less than the medium
// and the Sun's light: DIFFUSE_CELLS cells, of which `steps` is a multiple, take that of the one in
// their middle. WITHOUT_SUN leaves out what comes straight from the Sun, WITHOUT_DIFFUSE what was
// scattered or reflected before, WITHOUT_RAYLEIGH what the air itself scatters.
Passage march(Stretch way, int steps) {
    float r0 = ground_radius + way.height;
    // Cells on either side of the lowest point, at least one on each that there is.
    float cells = float(steps), near = sqrt(-way.near), far = sqrt(way.far);
    float before = clamp(floor(cells * near / (near + far + 1e-9) + 0.5), near > 0.0 ? 1.0 : 0.0,
                         far > 0.0 ? cells - 1.0 : cells);
    vec2 width = vec2(near / max(before, 1.0), far / max(cells - before, 1.0));
#ifdef WITHOUT_RAYLEIGH
    float by_rayleigh = 0.0;
#else
    float by_rayleigh = rayleigh_phase(way.nu);
#endif
    vec4 by_aerosol = aerosol_phase(way.nu);
    vec4 light = vec4(0.0), left = vec4(1.0);
#ifndef WITHOUT_SUN
    vec4 last_sun = vec4(0.0);
    float last_s = 0.0;
#endif
    for (int first = 0; first < steps; first += DIFFUSE_CELLS) {
#ifndef WITHOUT_DIFFUSE
        float middle = float(first) + 0.5 * float(DIFFUSE_CELLS) - before;
        float middle_width = middle < 0.0 ? width.x : width.y, middle_x = middle * middle_width;
        March at_middle = march_place(way, r0, sign(middle_x) * (middle_x * middle_x
                                                             + middle_width * middle_width / 12.0));
        DiffuseLight diffuse = diffuse_light(at_middle.height, at_middle.mu, at_middle.mu_sun, way.nu);
#endif
        for (int cell_of_group = 0; cell_of_group < DIFFUSE_CELLS; ++cell_of_group) {
            float from_lowest = float(first + cell_of_group) + 0.5 - before;
            float w = from_lowest < 0.0 ? width.x : width.y;
            float x = from_lowest * w;
            float cell = 2.0 * abs(x) * w;
            March here = march_place(way, r0, sign(x) * (x * x + w * w / 12.0));
            Medium medium = medium_at(here.height);
            vec4 source = vec4(0.0);
            vec4 depth = medium.extinction * cell;
            vec4 passed = exp(-depth);
#ifndef WITHOUT_SUN
            vec4 sun = transmittance_to_space(here.height, here.mu_sun)
                     * sun_above_horizon(here.height, here.mu_sun);
            // What is seen of an opaque cell lies before its middle by 1/2 + 1/(exp(depth) - 1) - 1/depth
            // of its length; the Sun's light there, by its change from the last cell.
            vec4 nearer = mix(0.5 + passed / max(1.0 - passed, 1e-6) - 1.0 / max(depth, 1e-6), depth / 12.0,
                              lessThan(depth, vec4(0.2)));
            float way_back = first + cell_of_group > 0 ? cell / max(here.s - last_s, 1e-9) : 0.0;
            vec4 seen_sun = max(sun + (last_sun - sun) * nearer * way_back, 0.0);
            last_sun = sun;
            last_s = here.s;
            source += seen_sun * (medium.rayleigh * by_rayleigh + medium.aerosol * by_aerosol);
#endif
#ifndef WITHOUT_DIFFUSE
            source += medium.rayleigh * diffuse.by_rayleigh + medium.aerosol * diffuse.by_aerosol;
#endif
            // (1 - exp(-depth)) / depth, by its series where the difference would cancel.
            vec4 mean = mix((1.0 - passed) / max(depth, 1e-6), 1.0 - depth * (0.5 - depth / 6.0),
                            lessThan(depth, vec4(0.02)));
            light += left * source * mean * cell;
            left *= passed;
        }
    }
    return Passage(light, left);
}
