// Two texels for each vertex and side: irradiance by surfaces [W m-2]; the share of the sky's light.
// What fills up the last line is 0.
#include "common/group.glsl"
#include "interreflection/sunlight.glsl"

layout(std430, binding = 3) readonly buffer Points { uint points[]; };  // the gather point of each
layout(std430, binding = 4) readonly buffer Light { vec4 light[]; };
layout(std430, binding = 5) readonly buffer Left { float left[]; };
layout(std430, binding = 6) readonly buffer Share { float share[]; };
#ifdef NEAR
// By other spacecraft: irradiance [W m-2], and behind all of it the share of the sky that they hide,
// four in each.
layout(std430, binding = 7) readonly buffer Others { vec4 others[]; };
#endif
layout(rgba32f, binding = 0) writeonly uniform image2D vertex_image;
uniform int count;

void main() {
    ivec2 place = ivec2(gl_GlobalInvocationID.xy);
    int columns = imageSize(vertex_image).x / 2, row = place.y * columns + place.x;
    if (place.x >= columns || place.y >= imageSize(vertex_image).y) return;
    if (row >= count) {
        imageStore(vertex_image, ivec2(2 * place.x, place.y), vec4(0.0));
        imageStore(vertex_image, ivec2(2 * place.x + 1, place.y), vec4(0.0));
        return;
    }
    uint point = points[row];
    vec4 irradiance = light[point];
    float seen = clamp(share[point], 0.0, 1.0);
#ifdef SUNLIT
    irradiance += left[point] * sunlight_at(row);
#endif
    irradiance = max(irradiance, 0.0);
#ifdef NEAR
    irradiance = max(irradiance + others[row], 0.0);
    seen = max(seen - others[count + row / 4][row % 4], 0.0);
#endif
    imageStore(vertex_image, ivec2(2 * place.x, place.y), irradiance);
    imageStore(vertex_image, ivec2(2 * place.x + 1, place.y), vec4(seen, 0.0, 0.0, 0.0));
}
