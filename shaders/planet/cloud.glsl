// Clouds as one thin layer: what they reflect, and how noise breaks them up.

// Of the optical thickness of code 1; code 0 is 1.
const float LOG_THICKEST = 4.6051702;

// Droplets scatter forward: asymmetry 0.85, scaled after Joseph, Wiscombe and Weinman (1976).
const float DROPLET_G = 0.85;
const float SCALED_TAU = 1.0 - DROPLET_G * DROPLET_G;
const float SCALED_G = DROPLET_G / (1.0 + DROPLET_G);

// Directional-hemispherical reflectance of a cloud that absorbs nothing, by the two-stream method in
// Eddington's form (Meador and Weaver 1980, eq. 24). tau: optical thickness; mu: cosine of the light.
float cloud_reflectance(float tau, float mu) {
    float scaled = SCALED_TAU * tau;
    float g1 = 0.75 * (1.0 - SCALED_G);
    float g3 = 0.5 - 0.75 * SCALED_G * mu;
    return (g1 * scaled + (g3 - g1 * mu) * (1.0 - exp(-scaled / mu))) / (1.0 + g1 * scaled);
}

// The same for light from all sides: the two-stream limit.
float cloud_diffuse_reflectance(float tau) {
    float g1_scaled = 0.75 * (1.0 - SCALED_G) * SCALED_TAU * tau;
    return g1_scaled / (1.0 + g1_scaled);
}

float cover_ramp(float share, float ragged) {
    return max(min(0.75 - 0.4 * ragged, 2.0 * min(share, 1.0 - share)), 0.008);
}

// Part of the sky covered at a place where `share` of the surroundings is: 0 or 1 but for a ramp.
// `level` is spread evenly over 0..1; the mean over it is `share` whatever the raggedness.
float cover_here(float share, float level, float ragged) {
    // Never 0 or 1, so that a share of 0 or 1 has no ramp.
    level = 0.004 + 0.992 * level;
    return clamp((level - 1.0 + share) / cover_ramp(share, ragged) + 0.5, 0.0, 1.0);
}

// How much thicker than their mean clouds are at a level: its mean, weighted by the cover, is 0.
float thicker(float share, float level, float ragged) {
    float ramp = cover_ramp(share, ragged);
    return 2.0 * level - 2.0 + share + ramp * ramp / (12.0 * max(share, 0.004));
}

float cloud_thickness(float code) {
    return exp(code * LOG_THICKEST);
}
