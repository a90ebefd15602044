// The sea: a mirror broken by waves over a dark body.
#include "common/constants.glsl"

const float WATER_INDEX = 1.34;
// Mean square slope of a sea without wind; power of the wind to which foam covers it.
const float CALM_SLOPES = 0.003, FOAM_POWER = 3.41;

// Reflectance of a flat water surface for unpolarised light at cosine `c` of incidence (Fresnel).
float fresnel_water(float c) {
    float g = sqrt(WATER_INDEX * WATER_INDEX - 1.0 + c * c);
    float a = (g - c) / (g + c), b = (c * (g + c) - 1.0) / (c * (g - c) + 1.0);
    return 0.5 * a * a * (1.0 + b * b);
}

// Smith's auxiliary function for normally distributed slopes (Walter et al. 2007, eq. 15), of the
// total mean square slope and the cosine of a direction.
float hidden_by_waves(float slope_variance, float c) {
    float a = c * inversesqrt(max(slope_variance * (1.0 - c * c), 1e-12));
    return a < 1.6 ? (1.0 - a * (1.259 - 0.396 * a)) / (a * (3.535 + 2.181 * a)) : 0.0;
}

// Bidirectional reflectance of the waves times the cosine of the light [sr-1]: glints of slopes that
// are normally distributed (Cox and Munk 1954), seen and lit past each other.
//
// normal, sun, view : unit; slope_variance : both components together
float glint(vec3 normal, vec3 sun, vec3 view, float slope_variance) {
    float mu_sun = dot(normal, sun), mu_view = max(dot(normal, view), 1e-3);
    vec3 half_way = normalize(sun + view);
    float cosine = max(dot(half_way, normal), 0.05);
    float cosine2 = cosine * cosine;
    float density = exp(max((1.0 - 1.0 / cosine2) / slope_variance, -60.0)) / (PI * slope_variance);
    float mirror = fresnel_water(max(dot(half_way, view), 0.0));
    float seen = 1.0 + hidden_by_waves(slope_variance, mu_view)
               + hidden_by_waves(slope_variance, max(mu_sun, 1e-3));
    return mu_sun > 0.0 ? density * mirror / (4.0 * mu_view * cosine2 * cosine2 * seen) : 0.0;
}
