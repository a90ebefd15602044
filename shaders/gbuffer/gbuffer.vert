// Spacecraft vertices from body axes to camera axes and to the tile's raster.
#include "block/tile"
#include "block/craft"
#ifdef JOINTED
#include "common/joints.glsl"
#endif

in vec3 in_position;   // as stored, body axes [m]
in vec3 in_normal;     // as stored, body axes, unit
in uvec2 in_labels;    // part; material, and from bit 6 on the rigid group
#ifdef DETAILED
in vec2 in_uv;         // place in the images
in vec4 in_tint;       // factors of the base colour
#endif
#ifdef EXCHANGE
in vec4 in_bounced;
in float in_earth_share;
out vec4 bounced;      // of gbuffer/gbuffer.frag
out float earth_share;
#ifdef TWO_SIDED
in vec4 in_bounced_back;
in float in_earth_share_back;
out vec4 bounced_back;
out float earth_share_back;
#endif
#endif

out float gl_ClipDistance[4];
out vec3 normal;       // camera axes
out vec3 body_position;   // [m]
flat out uint label;
#ifdef DETAILED
out vec2 uv;
out vec4 tint;
#endif

void main() {
    vec3 place = in_position, direction = in_normal;
#ifdef JOINTED
    place = place_from_stored(in_position, in_labels.y);
    direction = direction_from_stored(in_normal, in_labels.y);
#endif
    vec4 p = camera_from_body * vec4(place, 1.0);
    vec4 inside = tile_edges * vec4(p.xyz, 0.0);
    for (int edge = 0; edge < 4; ++edge) gl_ClipDistance[edge] = inside[edge];
    gl_Position = clip_from_camera * p;
    normal = mat3(camera_from_body) * direction;
    body_position = place;
    label = in_labels.y;
#ifdef DETAILED
    uv = in_uv;
    tint = in_tint;
#endif
#ifdef EXCHANGE
    bounced = in_bounced;
    earth_share = in_earth_share;
#ifdef TWO_SIDED
    bounced_back = in_bounced_back;
    earth_share_back = in_earth_share_back;
#endif
#endif
}
