// Planck's law in a thermal camera's band, from the table of simgl/thermal/thermal_view.py.

// Radiance [W m-2 sr-1], and as the detector counts.
uniform sampler2D planck;

const int PLANCK_STEPS = 4096;
const float HOTTEST = 1024.0;   // temperature of the last step [K]
const int PLANCK_COLUMNS = 2048;

vec2 planck_step(int step) {
    return texelFetch(planck, ivec2(step % PLANCK_COLUMNS, step / PLANCK_COLUMNS), 0).rg;
}

// Radiance of a black body.
//
// temperature : [K]
vec2 black_body(float temperature) {
    float at = clamp(temperature / HOTTEST, 0.0, 1.0) * float(PLANCK_STEPS - 1);
    int low = min(int(at), PLANCK_STEPS - 2);
    return mix(planck_step(low), planck_step(low + 1), at - float(low));
}
