// The aurora: layers of the air that shine where the oval and its arcs stand, at night [W m-2 sr-1].
//
// A ray is followed from edge to edge of the layers, of which each shines evenly along its height. Between
// two edges the way to an arc's middle line is taken as linear and the arc, which is thinner than the way,
// integrated in closed form.
#include "block/planet"
#include "block/aurora"
#include "common/constants.glsl"
#include "planet/night.glsl"
#include "planet/ray.glsl"
#ifdef AIR
#include "common/coverage.glsl"
#include "air/air.glsl"
#endif

out vec4 radiance;

// GLSL 3.30 takes the length of an array of a block for no constant.
#define LAYERS aurora_layers.length()
const int ARCS = 3;
// Layers below this one, up to 170 km, have rays.
const int RAYED = 8;
// Places of the arcs' middle lines across the oval, 0 towards the pole.
const vec3 ARC_PLACES = vec3(0.25, 0.5, 0.78);
// Of each arc, over their mean: its light, the depth of its folds, how many rays it has.
const vec3 ARC_LIGHT = vec3(0.5, 1.6, 0.9), ARC_FOLDS = vec3(0.5, 1.0, 1.7), ARC_RAYS = vec3(0.7, 1.0, 1.5);

// Of a normal variable, the share below x (Abramowitz and Stegun 7.1.25, 2.5e-5).
float share_below(float x) {
    float t = 1.0 / (1.0 + 0.33267 * abs(x));
    float tail = t * (0.4361836 + t * (-0.1201676 + t * 0.9372980)) * exp(-0.5 * x * x) * 0.3989423;
    return x < 0.0 ? tail : 1.0 - tail;
}

// What a place under the layers has of the aurora.
//
// even     : flux there over its mean over the oval, of the spread light
// arcs     : the same of each arc, at its middle line
// rays     : of green light in the arcs, over its mean: the red state lives for two minutes, and its
//            light is blurred
// away     : way to the arcs' middle lines over their widths, towards the equator
// by_night : how far night has fallen
struct Lit {
    float even;
    vec3 arcs;
    vec3 rays;
    vec3 away;
    float by_night;
};

// The magnetic direction of a geographic one, unit vectors.
vec3 magnetic(vec3 up) {
    vec4 place = vec4(up, 1.0);
    return normalize((up.z > 0.0 ? magnetic_north * place : magnetic_south * place).xyz);
}

// up : unit, geographic
Lit lit_at(vec3 up) {
    vec3 m = magnetic(up);
    float colatitude = acos(min(abs(m.z), 1.0));
    vec2 turn = mat2(midnight.x, -midnight.y, midnight.y, midnight.x) * m.xy * inversesqrt(dot(m.xy, m.xy) + 1e-12);
    float c = turn.x, s = turn.y, c2 = c * c - s * s, s2 = 2.0 * s * c;
    vec3 edges = oval_mean.xyz + oval_waves[0].xyz * c + oval_waves[1].xyz * s + oval_waves[2].xyz * c2
               + oval_waves[3].xyz * s2 + oval_waves[4].xyz * (c2 * c - s2 * s) + oval_waves[5].xyz * (s2 * c + c2 * s);
    float width = max(edges.y - edges.x, 0.01);
    Lit lit;
    lit.by_night = nightfall(dot(up, sun_direction_itrf.xyz));
    float x = (colatitude - edges.x) / width;
    float by_time = 1.0 + 0.6 * (c * 0.9239 - s * 0.3827);
    // As much as an even oval has between its edges, and faint light out to the diffuse one.
    lit.even = by_time * smoothstep(-0.25, 0.25, x) * (1.0 - smoothstep(0.75, 1.25, x))
             + rim * step(0.0, x) * (1.0 - smoothstep(1.0, 1.0 + max(edges.z - edges.y, 0.01) / width, x));
    float angle = atan(s, c);
    for (int arc = 0; arc < ARCS; arc++) {
        float shift = 2.1 * float(arc) + aurora_seed;
        // Folds of 2,000 to 30 km, deeper where the arc is disturbed.
        float calm = 1.0 + 0.7 * sin(4.0 * angle + 1.9 * shift);
        float folds = 60.0 * sin(7.0 * angle + 1.3 * shift) + 26.0 * sin(31.0 * angle + 2.1 * shift)
                    + 11.0 * sin(83.0 * angle + 3.7 * shift + 2.0 * sin(19.0 * angle))
                    + 4.0 * sin(271.0 * angle + 5.1 * shift + 3.0 * sin(53.0 * angle));
        lit.away[arc] = ((x - ARC_PLACES[arc]) * width * planet_km + ARC_FOLDS[arc] * calm * folds * min(width / 0.06, 1.0)) / arc_km;
        // Bright stretches of thousands of km, between which the arc fades away, and rays of 40 and 15 km
        // in them; their means are 1.
        float bright = (1.0 + sin(3.0 * angle + 1.7 * shift)) * (1.0 + 0.6 * sin(5.0 * angle + 0.6 * shift));
        float along = ARC_RAYS[arc] * angle;
        lit.rays[arc] = 1.0 + 0.35 * calm * sin(347.0 * along + 2.9 * shift + 4.0 * sin(29.0 * angle))
                      + 0.25 * sin(919.0 * along + 4.3 * shift + 3.0 * sin(71.0 * angle));
        lit.arcs[arc] = by_time * ARC_LIGHT[arc] * bright;
    }
    // An arc that holds a third of its share of the oval's width.
    lit.arcs *= width * planet_km / (float(ARCS) * arc_km * 2.5066);
    return lit;
}

// Mean flux between two places over its mean over the oval.
float between(Lit a, Lit b, bool rayed) {
    float even = 0.5 * (a.even * a.by_night + b.even * b.by_night);
    float arcs = 0.0;
    for (int arc = 0; arc < ARCS; arc++) {
        float way = b.away[arc] - a.away[arc], middle = 0.5 * (a.away[arc] + b.away[arc]);
        float mean = abs(way) < 0.05 ? 0.3989423 * exp(-0.5 * middle * middle)
                                     : (share_below(b.away[arc]) - share_below(a.away[arc])) / way;
        vec2 rays = rayed ? vec2(a.rays[arc], b.rays[arc]) : vec2(1.0);
        arcs += mean * 0.5 * (a.arcs[arc] * a.by_night * rays.x + b.arcs[arc] * b.by_night * rays.y);
    }
    return (1.0 - arc_share) * even + arc_share * 2.5066 * arcs;
}

vec3 place_above(Ray ray, float t) {
    return normalize((camera_in_sphere.xyz + t * ray.d) * sphere_axes.xyz);
}

// Whether the aurora may stand there: the oval's widest is 40 deg from the magnetic pole.
bool far_from_ovals(vec3 up) {
    vec3 m = magnetic(up);
    return abs(m.z) < oval_mean.w;
}

// The light of one passage through the layers, outwards for a side of 1, and inwards for -1.
vec4 passage(Ray ray, float side) {
    float lowest = -ray.od / ray.dd;
    float top = ray.od * ray.od - ray.dd * layer_outside[LAYERS].x;
    if (top <= 0.0) return vec4(0.0);
    float last_t = max(lowest + side * sqrt(top) / ray.dd, 0.0);
    float low_t = max(lowest + side * sqrt(max(ray.od * ray.od - ray.dd * layer_outside[0].x, 0.0)) / ray.dd, 0.0);
    if (last_t == low_t) return vec4(0.0);
    if (far_from_ovals(place_above(ray, last_t)) && far_from_ovals(place_above(ray, low_t))
        && far_from_ovals(place_above(ray, 0.5 * (last_t + low_t)))) return vec4(0.0);
    Lit last = lit_at(place_above(ray, last_t));
    vec4 light = vec4(0.0);
    for (int layer = LAYERS - 1; layer >= 0; layer--) {
        float root = sqrt(max(ray.od * ray.od - ray.dd * layer_outside[layer].x, 0.0)) / ray.dd;
        float t = max(lowest + side * root, 0.0);
        float way = abs(t - last_t);
        if (way > 0.0) {
            Lit here = lit_at(place_above(ray, t));
            light += aurora_layers[layer] * (way * between(last, here, layer < RAYED));
            last = here;
            last_t = t;
        }
    }
    return light * sqrt(ray.dd);
}

void main() {
    Ray ray = ray_through(gl_FragCoord.xy);
    radiance = passage(ray, -1.0);
#ifdef AIR
    float stretch = sqrt(ray.dd);
    float on_earth = ray.od < 0.0 ? coverage(ray.discriminant) : 0.0;
    if (on_earth < 1.0) {
        AirRay air = air_ray(ray.d / stretch, ray.od / stretch, ray.discriminant / ray.dd, on_earth);
        radiance += passage(ray, 1.0) * (1.0 - on_earth) * air.to_space;
    }
#else
    if (ray.od >= 0.0 || ray.discriminant < 0.0) radiance += passage(ray, 1.0);
#endif
}
