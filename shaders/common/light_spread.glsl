// A snapshot of a spacecraft that turns while the shutter is open has the light of all of the part of the
// exposure for which it stands (simgl/view/light_spread.py): what lobes turn to the viewer is the mean of
// several times, and of shadows each shading point has those of a time of its own. The sweep over their
// ways adds these up.
//
// Times are counted from the middle of that part, in halves of its length. The surface stays where it is
// in the middle, and the Sun and the viewer turn about it.
#include "block/spacecraft"
#include "common/turn.glsl"

// The times may be divided into LIGHT_PARTS equal parts, each with light of its own: `light_part` is the one
// of which lobes are looked at, counted from 0 on. Shadows have the times of all.

#ifndef LIGHT_PARTS
#define LIGHT_PARTS 1
#endif
int light_part = 0;

// So many shading points that add up have light of all times.
const float ENOUGH_POINTS = 8.0;
// Of times, so many are left to other points at most.
const float LEFT_TO_OTHERS = 4.0;
const float SUN_WIDTH = 0.0093, MAX_TIMES = 32.0;   // [rad]

// How many shading points add up in a pixel, that go along as a place does in a share of the exposure.
float points_that_add_up(vec3 place, float share) {
    float focal = spread_turn.w, cells = spread_shift.w;
    vec3 rate = cross(spread_turn.xyz, place - camera_from_body[3].xyz) + spread_shift.xyz;
    float way = 2.0 * focal * length(rate.xy - rate.z * place.xy / place.z) / place.z;
    return (1.0 + share * way) * cells * cells;
}

// Numbers 0..1 that spread evenly over any row of cells. Factors near 1 over the cells let rounding of a
// place change none by much.
float phase_of(vec3 place, vec2 factors) {
    return fract(dot(spread_turn.w * spread_shift.w / place.z * place.xy, factors));
}

// Times at which lobes are looked at.
struct Times {
    float count;
    float late;   // by which they are off the middles of equal parts, in these
};

// How many times of a part tell the mean of what a lobe turns to the viewer, by its width alpha: a third of that
// apart, they tell it to 1 %, for a lobe's second derivative is at most 4 of it over the square of alpha,
// a 24th of which times the square of the step is left. What is narrower the Sun's disc blurs. Where many
// points add up, each has some of the times.
Times spread_times(float alpha, vec3 place) {
    const float SHARE = 1.0 / float(LIGHT_PARTS);
    float all_times = clamp(ceil(SHARE * spread_sun.w / max(alpha / 3.0, SUN_WIDTH)), 1.0, MAX_TIMES);
    float fewer = clamp(points_that_add_up(place, SHARE) / ENOUGH_POINTS, 1.0, LEFT_TO_OTHERS);
    float count = ceil(all_times / fewer);
    float phase = phase_of(place, vec2(0.6180339887, 0.4142135624));
    return Times(count, count < all_times ? phase - 0.5 : 0.0);
}

// One of the times, numbered from 1 on.
float spread_time(float number, Times times) {
    float part = float(light_part) + (number - 0.5 + times.late) / times.count;
    return 2.0 * part / float(LIGHT_PARTS) - 1.0;
}

// The time of a shading point's shadows; camera axes.
float shadow_time(vec3 place) {
    // After the plastic number's relatives (M. Roberts 2018); they rise and fall.
    float phase = phase_of(place, vec2(0.7548776662, 0.5698402910));
    float points = points_that_add_up(place, 1.0);
    return min(points / ENOUGH_POINTS, 1.0) * (abs(4.0 * phase - 2.0) - 1.0);
}

// A direction that stands still in space at a time, as the surface sees it.
vec3 spread_light(vec3 direction, float time) {
    return turned(direction, -time * spread_sun.xyz);
}

// The same of one that goes along with the camera.
vec3 spread_lamp(vec3 direction, float time) {
    return turned(direction, -time * spread_turn.xyz);
}

// Unit, towards the viewer at a time, as the surface sees him.
vec3 spread_viewer(vec3 place, float time) {
    vec3 origin = camera_from_body[3].xyz;
    vec3 seen_from = turned(origin + time * spread_shift.xyz, -time * spread_turn.xyz);
    return -normalize(place - origin + seen_from);
}
