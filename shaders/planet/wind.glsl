// The wind over the sea, where a scenario says none.
#include "block/planet"
#include "common/constants.glsl"

// A wave of the wind over the sea, of variance 1/2, as far as a pixel resolves it.
//
// place, length, pixel : [km]
float gust(vec3 place, vec3 along, float length, float pixel) {
    float blurred = pixel / length;
    return sin(2.0 * PI / length * dot(along, place)) * exp(-5.0 * blurred * blurred);
}

// The wind at a place over its mean [1]: weather of 300 to 1,500 km, gusts of 15 to 90 km, and slicks, calm
// filaments a few km wide, which drift to the east by 7 m/s.
//
// up : unit; pixel : its footprint [km]
float wind_at(vec3 up, float pixel) {
    float turn = 2.2e5 / planet_km * year_share;
    vec3 place = planet_km * vec3(mat2(cos(turn), -sin(turn), sin(turn), cos(turn)) * up.xy, up.z);
    float wide = gust(place, vec3(0.36, 0.48, 0.80), 1450.0, pixel) + gust(place, vec3(0.80, -0.36, 0.48), 830.0, pixel)
               + 0.7 * gust(place, vec3(-0.48, 0.80, 0.36), 310.0, pixel);
    vec3 bent = place + 25.0 * wide;
    float gusts = gust(bent, vec3(0.60, 0.64, -0.48), 92.0, pixel) + gust(bent, vec3(0.28, -0.576, 0.768), 41.0, pixel)
                + 0.7 * gust(bent, vec3(-0.70, 0.14, 0.70), 17.0, pixel);
    // Where a slowly bending wave turns, in the calmer regions.
    float ridge = gust(bent + 4.0 * gusts, vec3(0.352, 0.36, 0.864), 57.0, pixel);
    float slick = smoothstep(0.93, 1.0, ridge) * clamp(0.5 - 0.6 * wide, 0.0, 1.0);
    return max(1.0 + 0.18 * wide + 0.07 * gusts, 0.2) * (1.0 - 0.6 * slick);
}
