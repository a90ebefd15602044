// Ground and clouds on tiles whose corners tiles.vert has found; nothing is seen past them.
#include "planet/ground.glsl"
#include "planet/packed_place.glsl"
#include "planet/sea_at_corners.glsl"

noperspective in PackedPlace parts;
noperspective in vec4 light;
#ifdef SEA_IS_EVEN
noperspective in Sea sea;
#endif

layout(location = 0, index = 0) out vec4 radiance;
layout(location = 0, index = 1) out vec4 beyond;

void main() {
    Place here = in_full(parts);
#ifndef SEA_IS_EVEN
    Sea sea = sea_at(here);
#endif
    radiance = light + mapped_sight(here, sea, 1.0, 1.0).light;
    beyond = vec4(0.0);
}
