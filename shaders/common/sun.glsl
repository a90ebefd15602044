#include "common/constants.glsl"

// Radiance of the Sun's disc at cosine of emergence `mu` over its mean, per band: the numpy function
// of the same name in simgl/physics/solar_disc.py.
vec4 limb_profile(float mu, vec4 u, vec4 v) {
    float fall = 1.0 - mu;
    return (1.0 - fall * (u + fall * v)) / (1.0 - u / 3.0 - v / 6.0);
}

// Mean of the profile along a stretch of the disc's radius, from `near` to `far`, within -1..1.
vec4 limb_mean(float near, float far, vec4 u, vec4 v) {
    near = min(near, far - 1e-3);   // rounding divided by less would show
    // Integrals of mu = sqrt(1 - r^2) and of mu^2.
    float mu_near = sqrt(1.0 - near * near), mu_far = sqrt(1.0 - far * far);
    float mu = 0.5 * (far * mu_far + atan(far, mu_far) - near * mu_near - atan(near, mu_near))
             / (far - near);
    float mu2 = 1.0 - (near * near + near * far + far * far) / 3.0;
    return (1.0 - u - v + (u + 2.0 * v) * mu - v * mu2) / (1.0 - u / 3.0 - v / 6.0);
}

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
