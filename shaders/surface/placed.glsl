#include "block/tile"
#include "block/craft"

out float gl_ClipDistance[4];

// Puts a vertex into the tile's raster, cut at its edges. Returns its place in camera axes [m].
//
// body : body axes [m]
vec3 placed(vec3 body) {
    vec4 p = camera_from_body * vec4(body, 1.0);
    vec4 inside = tile_edges * vec4(p.xyz, 0.0);
    for (int edge = 0; edge < 4; ++edge) gl_ClipDistance[edge] = inside[edge];
    gl_Position = clip_from_camera * p;
    return p.xyz;
}
