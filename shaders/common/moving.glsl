// A spacecraft that moves while the rows of the image are exposed one after the other
// (simgl/view/row_clock.py).
//
// Times are counted from the middle of a part of the exposure, in halves of its length.
#include "block/spacecraft"
#include "common/turn.glsl"

const int ROW_DEGREE = 7;   // of simgl/camera/row_curve.py
const float FARTHEST_TIME = 2.0, SLOWEST_ROWS = 0.25;   // as there

// When the row is exposed that a line of sight, or the place at its end, is seen in; camera axes.
float time_of(vec3 sight) {
#ifdef BENT_ROWS
    vec2 place = sight.xy / (length(sight) + sight.z);
    float time = 0.0, y = 1.0;
    int term = 0;
    for (int j = 0; j <= ROW_DEGREE; ++j) {
        float x = y;
        for (int i = 0; i <= ROW_DEGREE - j; ++i) {
            time += row_curve[term >> 2][term & 3] * x;
            x *= place.x;
            ++term;
        }
        y *= place.y;
    }
    return time;
#else
    return row_clock.x * sight.y / sight.z + row_clock.y;
#endif
}

// camera_from_body at a time.
mat4 pose_at(float time) {
    return camera_from_body + time * (pose_rate + time * (pose_change + time * pose_third));
}

// When the row is exposed that a place is seen in then.
//
// place : at time 0; rate : of what joints move, both in body axes [m]
float seen_time(vec3 place, vec3 rate) {
    float time = 0.0;
    for (int k = 0; k < 4; ++k) {
        mat4 pose = pose_at(time);
        vec4 point = vec4(place + time * rate, 1.0);
        vec3 p = (pose * point).xyz;
        mat4 change = pose_rate + time * (2.0 * pose_change + 3.0 * time * pose_third);
        vec3 v = (change * point).xyz + mat3(pose) * rate;
        p.z = max(p.z, 1e-3);
        float runs = 1.0 - row_clock.x * (v.y * p.z - p.y * v.z) / (p.z * p.z);
        time += (time_of(p) - time) / max(runs, SLOWEST_ROWS);
        time = clamp(time, -FARTHEST_TIME, FARTHEST_TIME);
    }
    return time;
}

// A direction that stands still in space at a time, of which camera axes at time 0 are given.
vec3 light_at(vec3 direction, float time) {
    return turned(direction, time * light_turn.xyz);
}
