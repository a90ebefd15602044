// What the chart's noise makes of clouds, below the weather map's texels.
#include "planet/chart.glsl"

// A place of the noise and of the maps: on the maps, longitude and latitude, 0..1 eastwards
// and southwards; on the charts, for all else and for fibres, where one face is enough for all of a tile, or
// two (TWO_FACES), with how near their axes are; and the vertical where not.
struct Spot {
    vec2 on_map;
#ifdef ONE_FACE
    vec2 on_chart;
    vec2 along_fibres;
#elif defined(TWO_FACES)
    vec4 on_charts;
    vec4 along_fibres;
    vec2 nearness;
#else
    vec3 up;
#endif
};

// Fibres run along the chart's first axis, drawn out, sheared and bent: where on the chart to read them for
// a place on it.
vec2 along_fibres(vec2 place) {
    float bend = 0.02 * sin(7.0 * place.x + 3.0 * place.y) + 0.05 * sin(2.3 * place.x);
    return vec2(place.x / 3.0, place.y + 0.15 * place.x + bend);
}

// Ice falls and is blown out along the wind, which is easterly or westerly but for the caps of the poles.
vec2 fibre_place(vec3 n) {
    vec3 a = abs(n);
    return along_fibres(a.x > max(a.y, a.z) ? chart_x(n) : a.y > a.z ? chart_y(n) : chart_z(n));
}

// The spot at a vertical, where that is on the maps.
Spot spot_on(vec2 on_map, vec3 n) {
#ifdef ONE_FACE
    return Spot(on_map, chart_place(n), fibre_place(n));
#elif defined(FACES_XY)
    return Spot(on_map, vec4(chart_x(n), chart_y(n)),
                vec4(along_fibres(chart_x(n)), along_fibres(chart_y(n))), abs(n.xy));
#elif defined(FACES_YZ)
    return Spot(on_map, vec4(chart_y(n), chart_z(n)),
                vec4(along_fibres(chart_y(n)), along_fibres(chart_z(n))), abs(n.yz));
#elif defined(FACES_ZX)
    return Spot(on_map, vec4(chart_z(n), chart_x(n)),
                vec4(along_fibres(chart_z(n)), along_fibres(chart_x(n))), abs(n.zx));
#else
    return Spot(on_map, n);
#endif
}

// The noise at a spot; none where pixels are too large for it.
vec4 noise_at(sampler2D image, Spot spot, float level) {
#ifdef FAR
    return vec4(0.0);
#elif defined(ONE_FACE)
    return chart_at(image, spot.on_chart, level);
#elif defined(TWO_FACES)
    vec2 weight = chart_weights(spot.nearness);
    return weight.x * chart_at(image, spot.on_charts.xy, level)
         + weight.y * chart_at(image, spot.on_charts.zw, level);
#else
    return chart_about(image, spot.up, level);
#endif
}

// What closed cells, open cells, cumulus and lumps have of a mix of their noises, by the map's code: one after
// the other they lie at 0, 1/3, 2/3 and 1. Squares are shares of the variance, which is 1.
vec4 cloud_kinds(float code) {
    vec4 near = max(1.0 - abs(3.0 * code - vec4(0.0, 1.0, 2.0, 3.0)), 0.0);
    return near * inversesqrt(dot(near, near));
}

// The noise of a mix at a spot.
float clouds_noise(Spot spot, float level, vec4 kinds) {
#ifdef FAR
    return 0.0;
#elif defined(ONE_FACE)
    return chart_mix_at(cloud_chart, spot.on_chart, level, kinds);
#elif defined(TWO_FACES)
    return dot(chart_weights(spot.nearness), vec2(chart_mix_at(cloud_chart, spot.on_charts.xy, level, kinds),
                                                  chart_mix_at(cloud_chart, spot.on_charts.zw, level, kinds)));
#else
    return dot(chart_about(cloud_chart, spot.up, level), kinds);
#endif
}

// Thickness of high cloud at a spot over its mean, which is 1.
//
// resolved : variance of the noise that a pixel resolves
float fibres(Spot spot, float level, float resolved) {
#ifdef FAR
    return 1.0;
#else
#ifdef ONE_FACE
    float noise = chart_at(chart, spot.along_fibres, level).w;
#elif defined(TWO_FACES)
    float noise = dot(chart_weights(spot.nearness), vec2(chart_at(chart, spot.along_fibres.xy, level).w,
                                                         chart_at(chart, spot.along_fibres.zw, level).w));
#else
    vec3 n = spot.up, share = chart_shares(n);
    float noise = share.x * chart_at(chart, along_fibres(chart_x(n)), level).w
                + share.y * chart_at(chart, along_fibres(chart_y(n)), level).w
                + share.z * chart_at(chart, along_fibres(chart_z(n)), level).w;
    noise *= inversesqrt(dot(share, share));
#endif
    // Spread like the exponential of a normal variable, whose mean is taken off.
    return exp(1.1 * (noise - 0.55 * resolved));
#endif
}
