// How the table of one camera's air is laid out: rows from nadir to the ground's horizon, from there
// to the top of the air or the camera's own level, and from that level to the zenith (for a camera
// inside the air). Between the second and the third part nothing jumps; the horizon itself lies
// between two rows, so that a place between them mixes ground and sky.
#include "block/airview"
#include "air/places.glsl"

// Rows along the limb crowd at its foot for a camera in space.
const float LIMB_FOOT = 0.25;

// Part of the rows for the ray's lowest height, as a share of the camera's or the top's by squared
// distance from the ground. Inside the air the last row lies along the camera's own level, where the
// air changes with the ray's angle.
float row_of_limb(float share) {
#ifdef AIR_INSIDE
    return sqrt(share / (1.0 + sqrt(1.0 - share)));
#else
    return sqrt(share * (1.0 + 2.0 * LIMB_FOOT) + LIMB_FOOT * LIMB_FOOT) - LIMB_FOOT;
#endif
}

float limb_of_row(float x) {
#ifdef AIR_INSIDE
    float y = 1.0 - x * x;
    return 1.0 - y * y;
#else
    return x * (x + 2.0 * LIMB_FOOT) / (1.0 + 2.0 * LIMB_FOOT);
#endif
}

const float GROUND_ROWS = 64.0, LIMB_ROWS = 160.0, SKY_ROWS = 64.0;

// Part of the rows for a direction with the cosine `mu` >= 0 from the vertical and `sine`: the root of
// the half angle's sine, which is even in angle at the vertical and crowds rows at the horizon.
float row_of_cosine(float mu, float sine) {
    return sqrt(mu * inversesqrt(1.0 + sine));
}

float cosine_of_row(float x) {
    float s = x * x;
    return s * sqrt(2.0 - s * s);
}

// Of a row of the ground or the limb: d of its straight ray [R^2], the squared cosine from the zenith
// where it meets the ground.
float d_of_row(float row) {
    float half_chord = cosine_of_row(1.0 - row / (GROUND_ROWS - 1.0));
    float above = horizon_reach * limb_of_row((row - GROUND_ROWS) / (LIMB_ROWS - 1.0));
    return row < GROUND_ROWS - 0.5 ? half_chord * half_chord : -above;
}
