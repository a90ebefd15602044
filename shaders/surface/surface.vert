// Spacecraft vertices from body axes to camera axes and to the tile's raster.
#include "block/tile"
#include "block/craft"

in vec3 in_position;   // body axes [m]
in vec3 in_normal;     // body axes, unit
in uvec2 in_labels;    // part, material

out vec3 position;     // camera axes [m]
out vec3 normal;       // camera axes
out vec3 light_clip;   // clip space of the shadow map
flat out uint material;

void main() {
    vec4 p = camera_from_body * vec4(in_position, 1.0);
    position = p.xyz;
    normal = mat3(camera_from_body) * in_normal;
    light_clip = (light_from_body * vec4(in_position, 1.0)).xyz;
    material = in_labels.y;
    gl_Position = clip_from_camera * p;
}
