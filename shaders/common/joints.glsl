// Where joints put what is stored, both in body axes.
//
// label : of a vertex or a sample; its material, and from bit 6 on the rigid group that it is part of
#include "block/joints"

vec3 place_from_stored(vec3 stored, uint label) {
    uint row = 3u * (label / 64u);
    vec4 place = vec4(stored, 1.0);
    return vec3(dot(joint_rows[row], place), dot(joint_rows[row + 1u], place),
                dot(joint_rows[row + 2u], place));
}

// The transpose, of a rotation also the inverse.
mat3 stored_from_turned(uint label) {
    uint row = 3u * (label / 64u);
    return mat3(joint_rows[row].xyz, joint_rows[row + 1u].xyz, joint_rows[row + 2u].xyz);
}

vec3 direction_from_stored(vec3 stored, uint label) {
    return stored * stored_from_turned(label);
}

vec3 stored_from_place(vec3 place, uint label) {
    uint row = 3u * (label / 64u);
    vec3 shift = vec3(joint_rows[row].w, joint_rows[row + 1u].w, joint_rows[row + 2u].w);
    return stored_from_turned(label) * (place - shift);
}
