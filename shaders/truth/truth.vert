// Spacecraft vertices at pixel centres, for depth and identity.
#include "block/tile"
#include "block/craft"
#ifdef JOINTED
#include "common/joints.glsl"
#endif
#ifdef CUT_OUT
#include "surface/cut_out_vertex.glsl"
#endif

in vec3 in_position;   // as stored, body axes [m]
in uvec2 in_labels;    // part; material, rigid group
#ifdef NORMALS
in vec3 in_normal;     // as stored, body axes, unit

out vec3 position;     // camera axes [m]
out vec3 normal;       // camera axes
#endif

out float depth;       // along the boresight [m]
flat out uint part;

void main() {
    vec3 place = in_position;
#ifdef JOINTED
    place = place_from_stored(in_position, in_labels.y);
#endif
    vec4 p = camera_from_body * vec4(place, 1.0);
    depth = p.z;
#ifdef NORMALS
    position = p.xyz;
    vec3 direction = in_normal;
#ifdef JOINTED
    direction = direction_from_stored(in_normal, in_labels.y);
#endif
    normal = mat3(camera_from_body) * direction;
#endif
    part = in_labels.x;
#ifdef CUT_OUT
    hand_on(in_labels.y & 63u);
#endif
    gl_Position = clip_from_camera * p;
}
