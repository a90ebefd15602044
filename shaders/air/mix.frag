// Between the tables of two angles of the Sun, which hold roots of light and transmittance.
#include "block/airmix"

uniform sampler2D light_0;
uniform sampler2D transmittance_0;
uniform sampler2D light_1;
uniform sampler2D transmittance_1;

layout(location = 0) out vec4 light;
layout(location = 1) out vec4 transmittance;

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy) - ivec2(0, first_mixed);
    light = mix(texelFetch(light_0, texel, 0), texelFetch(light_1, texel, 0), share);
    transmittance = mix(texelFetch(transmittance_0, texel, 0), texelFetch(transmittance_1, texel, 0), share);
}
