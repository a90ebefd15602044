// Noise over the whole sphere from two periodic images (simgl/scene/noise_projection.py), laid on the six
// faces of a cube about it.
#include "block/planet"

uniform sampler2D chart;         // slopes of hills, eddies of the sea, fibres of ice cloud
uniform sampler2D cloud_chart;   // closed cells, open cells, cumulus in streets, lumps

// Codes are 0.5 + value / CHART_RANGE.
const float CHART_RANGE = 8.0;
// Share of a face's half edge over which it goes over into its neighbours: 100 km on either side.
const float CHART_SEAM = 0.02;

// Where a unit vector lies on the chart of one face, whose axis is the last of its components.
//
// Gnomonic, but for a stretch that leaves the scale between 1 and 1.4 of that at the middle.
vec2 place_on_face(vec3 n, float face) {
    // What lies beyond a face's corners, where it has no share, is no number without a bound.
    vec2 across = vec2(n.x * sign(n.z), n.y) / max(abs(n.z), 0.5);
    vec2 place = across * (1.25 - 0.25 * across * across) * chart_repeats;
    // Waves bend the image's repetitions, and no two faces begin alike.
    return place + 0.08 * sin(place.yx * vec2(1.1, 1.3)) + face * vec2(0.37, 0.71);
}

// The first axis runs east on all but the faces of the poles.
vec2 chart_x(vec3 n) { return place_on_face(n.yzx, n.x < 0.0 ? 1.0 : 2.0); }
vec2 chart_y(vec3 n) { return place_on_face(vec3(-n.x, n.zy), n.y < 0.0 ? 3.0 : 4.0); }
vec2 chart_z(vec3 n) { return place_on_face(n, n.z < 0.0 ? 5.0 : 6.0); }

// What of a face each of the three axes has that a place lies nearest to; they sum to 1.
vec3 chart_shares(vec3 n) {
    vec3 a = abs(n);
    vec3 share = max(a - (1.0 - CHART_SEAM) * max(a.x, max(a.y, a.z)), 0.0);
    return share / (share.x + share.y + share.z);
}

// The place on the chart of the face that a unit vector lies on, away from its edges.
vec2 chart_place(vec3 n) {
    vec3 a = abs(n);
    return a.x > max(a.y, a.z) ? chart_x(n) : a.y > a.z ? chart_y(n) : chart_z(n);
}

// Cosine and sine of the angle by which the chart's axes there are turned from east and north.
vec2 chart_turn(vec3 n, vec3 east, vec3 north) {
    vec3 a = abs(n);
    vec3 along = a.x > max(a.y, a.z) ? vec3(0.0, sign(n.x), 0.0)
               : a.y > a.z ? vec3(-sign(n.y), 0.0, 0.0) : vec3(sign(n.z), 0.0, 0.0);
    return normalize(vec2(dot(along, east), dot(along, north)));
}

// Halvings of the image that are read where a pixel spans so many: of EVEN tiles, all that the
// texture holds, which is one of them.
float chart_level(float spanned) {
#ifdef FAR
    return chart_last;
#elif defined(EVEN)
    return log2(chart_texels / float(textureSize(chart, 0).x));
#else
    return min(floor(spanned + 0.5), chart_last);
#endif
}

vec4 chart_codes(sampler2D image, vec2 place, float level) {
#ifdef EVEN
    level = 0.0;
#endif
    return textureLod(image, place, level);
}

// What a chart says, each of variance 1 where `level` is 0: halvings of the image.
vec4 chart_at(sampler2D image, vec2 place, float level) {
    return chart_codes(image, place, level) * CHART_RANGE - 0.5 * CHART_RANGE;
}

// Of that a mix.
float chart_mix_at(sampler2D image, vec2 place, float level, vec4 weights) {
    return dot(chart_codes(image, place, level), weights) * CHART_RANGE
         - dot(weights, vec4(0.5 * CHART_RANGE));
}

// What two faces have of the noise where their axes are so near, as far as no third one has any: they
// are mixed, and keep the variance.
vec2 chart_weights(vec2 nearness) {
    vec2 share = max(nearness - (1.0 - CHART_SEAM) * max(nearness.x, nearness.y), 0.0);
    return share * inversesqrt(dot(share, share));
}

// The noise anywhere.
vec4 chart_about(sampler2D image, vec3 n, float level) {
    vec3 share = chart_shares(n);
    return (share.x * chart_at(image, chart_x(n), level) + share.y * chart_at(image, chart_y(n), level)
            + share.z * chart_at(image, chart_z(n), level)) * inversesqrt(dot(share, share));
}
