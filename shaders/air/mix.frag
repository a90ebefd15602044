// Between the tables of four angles of the Sun, which hold roots of light and transmittance.
#include "block/airmix"

uniform sampler2D light_0;
uniform sampler2D transmittance_0;
uniform sampler2D light_1;
uniform sampler2D transmittance_1;
uniform sampler2D light_2;
uniform sampler2D transmittance_2;
uniform sampler2D light_3;
uniform sampler2D transmittance_3;

layout(location = 0) out vec4 light;
layout(location = 1) out vec4 transmittance;

vec4 mixed(vec4 a, vec4 b, vec4 c, vec4 d) {
    // A cubic may swing below 0 where light ends.
    return max(mat4(a, b, c, d) * node_weights, 0.0);
}

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy) - ivec2(0, first_mixed);
    light = mixed(texelFetch(light_0, texel, 0), texelFetch(light_1, texel, 0),
                  texelFetch(light_2, texel, 0), texelFetch(light_3, texel, 0));
    transmittance = mixed(texelFetch(transmittance_0, texel, 0), texelFetch(transmittance_1, texel, 0),
                          texelFetch(transmittance_2, texel, 0), texelFetch(transmittance_3, texel, 0));
}
