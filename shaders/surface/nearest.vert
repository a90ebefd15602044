// Spacecraft in the tile's raster, for their depth alone.
#include "surface/placed.glsl"

in vec3 in_position;   // body axes [m]

void main() {
    placed(in_position);
}
