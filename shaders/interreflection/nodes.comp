// A texel for each node of a grid: irradiance by surfaces in the Sun more than is linear between the
// corners of its triangle [W m-2]. What fills up the last line is 0.
#include "common/group.glsl"
#include "interreflection/sunlight.glsl"

layout(std430, binding = 3) readonly buffer Corners { uint corners[]; };  // three gather points of each
layout(std430, binding = 4) readonly buffer Left { float left[]; };
layout(rgba32f, binding = 0) writeonly uniform image2D node_image;
uniform int first_node, count;

void main() {
    ivec2 place = ivec2(gl_GlobalInvocationID.xy);
    int columns = imageSize(node_image).x, row = place.y * columns + place.x;
    if (place.x >= columns || place.y >= imageSize(node_image).y) return;
    if (row >= count) {
        imageStore(node_image, place, vec4(0.0));
        return;
    }
    float sum = left[corners[3 * row]] + left[corners[3 * row + 1]] + left[corners[3 * row + 2]];
    imageStore(node_image, place, sum / 3.0 * sunlight_at(first_node + row));
}
