// Spacecraft vertices at pixel centres, for depth and identity.
#include "block/tile"
#include "block/craft"
#ifdef CUT_OUT
#include "surface/cut_out_vertex.glsl"
#endif

in vec3 in_position;   // body axes [m]
in uvec2 in_labels;    // part; material, joint

out float depth;       // along the boresight [m]
flat out uint part;

void main() {
    vec4 p = camera_from_body * vec4(in_position, 1.0);
    depth = p.z;
    part = in_labels.x;
#ifdef CUT_OUT
    hand_on(in_labels.y & 63u);
#endif
    gl_Position = clip_from_camera * p;
}
