// The tiles that are found pixel by pixel.
#include "block/planet"
#include "common/tile_corner.glsl"

void main() {
    gl_Position = vec4((area.xy + tile_corner()) * area.zw - 1.0, 0.0, 1.0);
}
