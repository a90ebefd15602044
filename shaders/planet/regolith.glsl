// Ground of loose grains: the law of simgl/physics/regolith.py.
#include "block/regolith"
#include "common/constants.glsl"

// exp(-2/pi cot(theta) cot(x)) and exp(-1/pi cot^2(theta) cot^2(x)).
vec2 regolith_falls(float cosine, float sine) {
    float cot = cosine / (max(sine, 1e-5) * slope_tangent);
    return exp(-vec2(2.0 * cot, cot * cot) / PI);
}

float regolith_visibility(float cosine, float sine, vec2 fall) {
    return slope_chi * (cosine + sine * slope_tangent * fall.y / (2.0 - fall.x));
}

// Bidirectional reflectance [sr-1] at cosines of incidence, emergence (both above 0) and phase.
float regolith_reflectance(float mu0, float mu, float cos_phase) {
    float sin_i = sqrt(max(1.0 - mu0 * mu0, 0.0)), sin_e = sqrt(max(1.0 - mu * mu, 0.0));
    float sines = sin_i * sin_e;
    float cos_psi = sines > 1e-5 ? clamp((cos_phase - mu0 * mu) / sines, -1.0, 1.0) : 1.0;
    float half_turn = 0.5 * (1.0 - cos_psi);
    float psi = atan(sqrt(max(1.0 - cos_psi * cos_psi, 0.0)), cos_psi) / PI;

    vec2 fall_i = regolith_falls(mu0, sin_i), fall_e = regolith_falls(mu, sin_e);
    bool low_sun = mu0 < mu;
    vec2 a = low_sun ? fall_i : fall_e, b = low_sun ? fall_e : fall_i;
    float below = 2.0 - a.x - psi * b.x;
    float slanter = slope_tangent * (a.y - half_turn * b.y) / below;
    float other = slope_tangent * (cos_psi * a.y + half_turn * b.y) / below;
    float mu0e = slope_chi * (mu0 + sin_i * (low_sun ? slanter : other));
    float mue = slope_chi * (mu + sin_e * (low_sun ? other : slanter));
    float part_i = mu0 / regolith_visibility(mu0, sin_i, fall_i);
    float eta_e = regolith_visibility(mu, sin_e, fall_e);
    float hidden = exp(-2.0 * sqrt(half_turn / max(1.0 - half_turn, 1e-6)));
    float steeper = low_sun ? mu / eta_e : part_i;
    float shade = mue / eta_e * part_i * slope_chi
                / (1.0 - hidden + hidden * slope_chi * steeper);

    float tangent = sqrt(max(1.0 - cos_phase, 0.0) / max(1.0 + cos_phase, 1e-6));
    float square = 1.0 + lobe_width * lobe_width;
    float lobes = (1.0 - lobe_width * lobe_width)
                * mix(pow(square + 2.0 * lobe_width * cos_phase, -1.5),
                      pow(square - 2.0 * lobe_width * cos_phase, -1.5), lobe_backward);
    float gamma = sqrt(1.0 - grain_albedo);
    float multiple = (1.0 + 2.0 * mu0e) / (1.0 + 2.0 * mu0e * gamma)
                   * (1.0 + 2.0 * mue) / (1.0 + 2.0 * mue * gamma) - 1.0;
    float surge = 1.0 + surge_height / (1.0 + tangent / surge_width);
    return grain_albedo / (4.0 * PI) * mu0e / (mu0e + mue) * (lobes * surge + multiple) * shade;
}
