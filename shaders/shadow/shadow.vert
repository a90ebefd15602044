// Casters along the light: depth only.
#include "block/caster"
#ifdef JOINTED
#include "common/joints.glsl"
#endif
#ifdef CUT_OUT
#include "surface/cut_out_vertex.glsl"
#endif

in vec3 in_position;   // as stored, body axes [m]
#if defined(CUT_OUT) || defined(JOINTED)
in uvec2 in_labels;    // part; material, rigid group
#endif

void main() {
#ifdef CUT_OUT
    hand_on(in_labels.y & 63u);
#endif
    vec3 place = in_position;
#ifdef JOINTED
    place = place_from_stored(in_position, in_labels.y);
#endif
    gl_Position = caster_clip_from_body * vec4(place, 1.0);
}
