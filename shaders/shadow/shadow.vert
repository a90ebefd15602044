// Casters along the light: depth only.
#include "block/caster"

in vec3 in_position;   // body axes [m]

void main() {
    gl_Position = caster_light_from_body * vec4(in_position, 1.0);
}
