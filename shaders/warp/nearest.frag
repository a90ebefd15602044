// Depth along the boresight [m], identity and normal in camera axes that a pixel's middle sees, from a finer image without distortion.
#include "block/warp"

uniform sampler2D places;
uniform sampler2D fine_depth;
uniform usampler2D fine_part;
uniform sampler2D fine_normal;

layout(location = 0) out float depth;
layout(location = 1) out uint part;
layout(location = 2) out vec4 normal;

void main() {
    vec3 place = texelFetch(places, ivec2(gl_FragCoord.xy), 0).xyz;
    if (place.z == 0.0) discard;   // drawn through another pinhole, or not at all
    vec2 middle = place.xy;
    // Of an odd number of fine pixels one lies in the middle of the image.
    ivec2 texel = ivec2(floor(middle * fine_per_pixel + 0.5));
    mat3 turn = mat3(camera_from_pinhole);
    vec2 tangents = (middle - pinhole_boresight_px) / pinhole_focal_px;
    depth = texelFetch(fine_depth, texel, 0).r * (turn * vec3(tangents, 1.0)).z;
    part = texelFetch(fine_part, texel, 0).r;
    normal = vec4(turn * texelFetch(fine_normal, texel, 0).xyz, 0.0);
}
