// Spacecraft vertices at pixel centres, for depth and identity.
#include "block/tile"
#include "block/craft"
#ifdef CUT_OUT
#include "surface/cut_out_vertex.glsl"
#endif

in vec3 in_position;   // body axes [m]
in uvec2 in_labels;    // part; material, joint
#ifdef NORMALS
in vec3 in_normal;     // body axes, unit

out vec3 position;     // camera axes [m]
out vec3 normal;       // camera axes
#endif

out float depth;       // along the boresight [m]
flat out uint part;

void main() {
    vec4 p = camera_from_body * vec4(in_position, 1.0);
    depth = p.z;
#ifdef NORMALS
    position = p.xyz;
    normal = mat3(camera_from_body) * in_normal;
#endif
    part = in_labels.x;
#ifdef CUT_OUT
    hand_on(in_labels.y & 63u);
#endif
    gl_Position = clip_from_camera * p;
}
