// The clear air as a medium, per band. In this folder heights and lengths are [km], coefficients
// [km-1], radiances [sr-1] and irradiances without unit: both for sunlight of 1 W m-2.
#include "block/air"
#include "common/constants.glsl"

// What a kilometre of air scatters, and takes by scattering and absorption.
struct Medium {
    vec4 rayleigh;
    vec4 aerosol;
    vec4 extinction;
};

// r^2 - ground_radius^2, without the cancellation.
float above_ground(float height) {
    return height * (2.0 * ground_radius + height);
}

// Share of the Sun's disc above the horizon of a place at `height`, where the Sun's centre has the
// cosine `mu_sun` from the zenith. The smooth step stays within 2 % of the disc's true share.
float sun_above_horizon(float height, float mu_sun) {
    float r = ground_radius + height;
    float width = sun_half_angle * ground_radius / r;
    float horizon = -sqrt(above_ground(height)) / r;
    return smoothstep(-width, width, mu_sun - horizon);
}

// Scattered share per steradian about the cosine `nu` between the light's way before and after.
// Rayleigh without polarisation, with King's correction; aerosol after Henyey & Greenstein (1941).
float rayleigh_phase(float nu) {
    return 3.0 / (16.0 * PI) * (rayleigh_shape.x + rayleigh_shape.y * nu * nu);
}

vec4 aerosol_phase(float nu) {
    vec4 g = aerosol_asymmetry;
    vec4 d = 1.0 + g * g - 2.0 * g * nu;
    return (1.0 - g * g) / (4.0 * PI * d * sqrt(d));
}
