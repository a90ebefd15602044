// Depth [m], identity and normal that a pixel's middle sees, from a finer image without distortion.
#include "block/warp"

uniform sampler2D places;
uniform sampler2D fine_depth;
uniform usampler2D fine_part;
uniform sampler2D fine_normal;

layout(location = 0) out float depth;
layout(location = 1) out uint part;
layout(location = 2) out vec4 normal;

void main() {
    vec2 middle = texelFetch(places, ivec2(gl_FragCoord.xy), 0).xy;
    // Of an odd number of fine pixels one lies in the middle of the image.
    ivec2 texel = ivec2(floor(middle * fine_per_pixel + 0.5));
    depth = texelFetch(fine_depth, texel, 0).r;
    part = texelFetch(fine_part, texel, 0).r;
    normal = texelFetch(fine_normal, texel, 0);
}
