// The wind over the sea, where a scenario says none.
#include "block/planet"
#include "common/constants.glsl"
#include "planet/puffs.glsl"

// Where the tangent of a wave that mirrors the Sun squared is more, the glint is too faint to show eddies and
// streaks; from the first on they fade (simgl/view/background_tiles.py).
const float DETAIL_FADES = 0.10, NO_DETAIL = 0.24;

// A wave of the wind over the sea, of variance 1/2, as far as a pixel resolves it.
//
// place, length, pixel : [km]
float gust(vec3 place, vec3 along, float length, float pixel) {
    float blurred = pixel / length;
    return sin(2.0 * PI / length * dot(along, place)) * exp(-5.0 * blurred * blurred);
}

float belt(float sine, float middle, float width) {
    float off = (sine - middle) / width;
    return exp(-off * off);
}

// The wind at a place over its mean over the sea: trades on either side of the calms, which follow the Sun,
// and the storm tracks, the northern one in winter; with weather of 300 to 1,500 km, which drifts to the east
// by 7 m/s.
//
// up : unit; pixel : its footprint [km]
float wind_over(vec3 up, float pixel) {
    float calms = 0.09 + 0.06 * cos(2.0 * PI * (year_share - 0.68));
    float winter = cos(2.0 * PI * (year_share - 0.04));
    float mean = 0.83 - 0.16 * belt(up.z, calms, 0.10)
               + 0.21 * (belt(up.z, calms + 0.25, 0.13) + belt(up.z, calms - 0.30, 0.15))
               + 0.59 * belt(up.z, -0.78, 0.17) + (0.30 + 0.15 * winter) * belt(up.z, 0.76, 0.14);
    float turn = 2.2e5 / planet_km * year_share;
    vec3 place = planet_km * vec3(mat2(cos(turn), -sin(turn), sin(turn), cos(turn)) * up.xy, up.z);
    float weather = gust(place, vec3(0.36, 0.48, 0.80), 1450.0, pixel)
                  + gust(place, vec3(0.80, -0.36, 0.48), 830.0, pixel)
                  + 0.7 * gust(place, vec3(-0.48, 0.80, 0.36), 310.0, pixel);
    return mean * max(1.0 + 0.25 * weather, 0.25);
}

// The chart drawn out to twice its size: eddies of 10 to 100 km.
vec4 eddies_at(Spot spot, float level) {
#ifdef FAR
    return vec4(0.0);
#elif defined(ONE_FACE)
    return chart_at(chart, 0.5 * spot.on_chart, level);
#elif defined(TWO_FACES)
    vec2 weight = chart_weights(spot.nearness);
    return weight.x * chart_at(chart, 0.5 * spot.on_charts.xy, level)
         + weight.y * chart_at(chart, 0.5 * spot.on_charts.zw, level);
#else
    vec3 n = spot.up, share = chart_shares(n);
    vec4 noise = share.x * chart_at(chart, 0.5 * chart_x(n), level)
               + share.y * chart_at(chart, 0.5 * chart_y(n), level)
               + share.z * chart_at(chart, 0.5 * chart_z(n), level);
    return noise * inversesqrt(dot(share, share));
#endif
}

// The wind that a pixel sees at work: less and more of it in eddies, streaks along it; and where it is calm
// slicks, filaments of a film that smooths the waves.
//
// wind : there, over the mean over the sea
// eddies : what the chart says
float wind_at_work(float wind, vec4 eddies) {
    float slick = smoothstep(0.8, 1.9, eddies.z) * clamp(2.4 - 2.0 * wind, 0.0, 1.0);
    return wind * max(1.0 - 0.10 * eddies.z + 0.06 * eddies.w, 0.3) * (1.0 - 0.55 * slick);
}
