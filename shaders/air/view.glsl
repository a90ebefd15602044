// How the table of one camera's air is laid out: rows from nadir to the ground's horizon, from there
// to the top of the air or the camera's own level, and from that level to the zenith (for a camera
// inside the air). Between the second and the third part nothing jumps; the horizon itself lies
// between two rows, so that a place between them mixes ground and sky.
#include "block/airview"
#include "air/places.glsl"

const float GROUND_ROWS = 64.0, LIMB_ROWS = 128.0, SKY_ROWS = 64.0;

// Part of the rows for a direction with the cosine `mu` >= 0 from the vertical and `sine`: the root of
// the half angle's sine, which is even in angle at the vertical and crowds rows at the horizon.
float row_of_cosine(float mu, float sine) {
    return sqrt(mu * inversesqrt(1.0 + sine));
}

float cosine_of_row(float x) {
    float s = x * x;
    return s * sqrt(2.0 - s * s);
}
