// Ground and clouds on tiles whose corners tiles.vert has found; nothing is seen past them.
#include "planet/ground.glsl"

noperspective in Place seen;
noperspective in vec4 light;

layout(location = 0, index = 0) out vec4 radiance;
layout(location = 0, index = 1) out vec4 beyond;

void main() {
    radiance = light + ground_sight(seen, 1.0, 1.0).light;
    beyond = vec4(0.0);
}
