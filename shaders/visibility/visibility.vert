// Spacecraft vertices from body axes to the tile's raster.
#include "block/tile"
#include "block/spacecraft"
#ifdef JOINTED
#include "common/joints.glsl"
#endif
#ifdef MOVING
#include "common/moving.glsl"
#endif
#ifdef JOINTS_MOVE
#include "common/joint_rates.glsl"
#endif
#ifdef CUT_OUT
#include "surface/cut_out_vertex.glsl"
#endif

in vec3 in_position;   // as stored, body axes [m]
#if defined(CUT_OUT) || defined(JOINTED) || defined(JOINTS_MOVE)
in uvec2 in_labels;    // part; material, and from bit 6 on the rigid group
#endif

out float gl_ClipDistance[4];

void main() {
    vec3 place = in_position;
#ifdef JOINTED
    place = place_from_stored(in_position, in_labels.y);
#endif
#ifdef CUT_OUT
    hand_on(in_labels.y & 63u);
#endif
#ifdef MOVING
    vec3 rate = vec3(0.0);
#ifdef JOINTS_MOVE
    rate = rate_of_place(place, in_labels.y);
#endif
    // Each at its row's own time.
    float time = seen_time(place, rate);
    vec4 p = pose_at(time) * vec4(place + time * rate, 1.0);
#else
    vec4 p = camera_from_body * vec4(place, 1.0);
#endif
    vec4 inside = tile_edges * vec4(p.xyz, 0.0);
    for (int edge = 0; edge < 4; ++edge) gl_ClipDistance[edge] = inside[edge];
    gl_Position = clip_from_camera * p;
}
