// Casters along the light: depth only.
#include "block/caster"
#ifdef CUT_OUT
#include "surface/cut_out_vertex.glsl"
#endif

in vec3 in_position;   // body axes [m]
#ifdef CUT_OUT
in uvec2 in_labels;    // part; material, joint
#endif

void main() {
#ifdef CUT_OUT
    hand_on(in_labels.y & 63u);
#endif
    gl_Position = caster_clip_from_body * vec4(in_position, 1.0);
}
