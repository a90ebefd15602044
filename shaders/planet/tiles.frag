// Ground and clouds on tiles whose corners tiles.vert has found; nothing is seen past them.
#include "planet/ground.glsl"

noperspective in Place place;
noperspective in vec4 light;
#if defined(SEA_AT_CORNERS) && !defined(GLINT)
noperspective in Sea sea;
#endif

layout(location = 0, index = 0) out vec4 radiance;
layout(location = 0, index = 1) out vec4 beyond;

void main() {
    Place here = place;
#ifndef ONE_FACE
    here.turn = turn_at(here.normal);
#endif
#if !defined(SEA_AT_CORNERS) || defined(GLINT)
    Sea sea = sea_at(here);
#endif
    radiance = light + mapped_sight(here, sea, 1.0, 1.0).light;
    beyond = vec4(0.0);
}
