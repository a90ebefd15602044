// A snapshot of a spacecraft that turns while the shutter is open has the light of all of the part of the
// exposure for which it stands (simgl/view/light_spread.py): what lobes turn to the viewer is the mean of
// several times, and of shadows each shading point has those of a time of its own. The sweep over their
// ways adds these up.
//
// Times are counted from the middle of that part, in halves of its length. The surface stays where it is
// in the middle, and the Sun and the viewer turn about it.
#include "block/spacecraft"
#include "common/turn.glsl"

// So many shading points that add up have light of all times.
const float ENOUGH_POINTS = 8.0;
const float SUN_WIDTH = 0.0093, MAX_TIMES = 32.0;   // [rad]

// How many times tell the mean of what a lobe turns to the viewer, by its width alpha: a third of that
// apart, they tell it to 1 %, for a lobe's second derivative is at most 4 of it over the square of alpha,
// a 24th of which times the square of the step is left. What is narrower the Sun's disc blurs.
float spread_times(float alpha) {
    return clamp(ceil(spread_sun.w / max(alpha / 3.0, SUN_WIDTH)), 1.0, MAX_TIMES);
}

// One of so many times, numbered from 1 on.
float spread_time(float number, float times) {
    return (2.0 * number - 1.0) / times - 1.0;
}

// The time of a shading point's shadows; camera axes.
float shadow_time(vec3 place) {
    float focal = spread_turn.w, cells = spread_shift.w;
    vec2 sight = place.xy / place.z;
    vec3 rate = cross(spread_turn.xyz, place - camera_from_body[3].xyz) + spread_shift.xyz;
    float way = 2.0 * focal * length(rate.xy - rate.z * sight) / place.z;
    float points = (1.0 + way) * cells * cells;
    // Numbers that spread evenly over any row of cells, after the plastic number's relatives (M. Roberts
    // 2018). They rise and fall, so that rounding of a place changes none by much.
    float phase = fract(dot(focal * cells * sight, vec2(0.7548776662, 0.5698402910)));
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
