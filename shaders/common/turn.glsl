// Turns.

// A direction turned by a rotation vector [rad], good to 1e-4 up to half a radian.
vec3 turned(vec3 direction, vec3 rotation) {
    // Half its tangent along its axis (Rodrigues).
    vec3 turn = 0.5 * rotation;
    turn *= 1.0 + dot(turn, turn) / 3.0;
    return direction + 2.0 / (1.0 + dot(turn, turn)) * cross(turn, direction + cross(turn, direction));
}
