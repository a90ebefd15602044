#include "common/constants.glsl"

// Effective cosine of a plane under a small uniform disc: irradiance on the plane over the
// irradiance on a plane facing the disc. `cosine` between the plane's normal and the disc's centre,
// `a` angular radius [rad]. Within `a` of the plane's horizon the disc is cut: integrating
// max(height, 0) over a flat disc of unit radius at height x gives the bracket; it is 0 at x = -1
// and x at x = 1, so the result joins max(cosine, 0) smoothly.
float disc_cosine(float cosine, float a) {
    if (abs(cosine) >= a) return max(cosine, 0.0);
    float x = cosine / a;
    float chord = sqrt(1.0 - x * x);
    // atan(x, chord) is asin(x), which drivers compute to 1e-4 only.
    return a / PI * (chord * (2.0 + x * x) / 3.0 + x * (0.5 * PI + atan(x, chord)));
}
