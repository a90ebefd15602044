// How fast joints move places.
#include "block/jointrates"

// place : where the joints have put it; the result for each time of common/moving.glsl [m]
vec3 rate_of_place(vec3 place, uint label) {
    uint row = 3u * (label / 64u);
    vec4 point = vec4(place, 1.0);
    return vec3(dot(joint_rate_rows[row], point), dot(joint_rate_rows[row + 1u], point),
                dot(joint_rate_rows[row + 2u], point));
}
