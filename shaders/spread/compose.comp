// Results of a spread, what is near to its source and what has come far together: of each pixel the
// four bands, or by MOSAIC that of its filter, four neighbours of a row in each texel.
#include "common/group.glsl"
#include "spread/between_cells.glsl"

// Two results as one complex layer.
layout(std430, binding = 0) readonly buffer Near { vec2 near_light[]; };
layout(std430, binding = 1) readonly buffer Far { vec2 far_light[]; };  // on the coarse grid
#ifdef BESIDES
// (RESULTS, rows, columns) of the image.
layout(std430, binding = 2) readonly buffer Besides { float besides[]; };
#endif
layout(rgba32f, binding = 0) uniform image2D target_image;

uniform ivec2 image;                // columns, rows, with the margin around it
uniform int margin;                 // of columns and rows on each side that are left out
uniform ivec2 near_size, far_size;  // of a layer
uniform float near_share, factor;   // of what is near, of all
#ifdef MOSAIC
uniform ivec4 results;  // of the pixels (0, 0), (1, 0), (0, 1), (1, 1) and all others like them
uniform int adds;       // whether to what is there
#endif

float of_pair(vec2 pair, int result) { return result % 2 == 0 ? pair.x : pair.y; }

float far_at(ivec2 cell, int result) {
    vec2 pair = far_light[(result / 2 * far_size.y + cell.y) * far_size.x + cell.x];
    // Negative values are rounding errors.
    return max(of_pair(pair, result), 0.0);
}

float light(ivec2 pixel, int result) {
    vec2 pair = near_light[(result / 2 * near_size.y + pixel.y) * near_size.x + pixel.x];
    float sum = near_share * max(of_pair(pair, result), 0.0);
    ivec2 cells = cells_of(image);
    vec2 at = among_cells(vec2(pixel), cells);
    ivec2 low = min(ivec2(at), max(cells - 2, 0)), high = min(low + 1, cells - 1);
    vec2 more = at - vec2(low);
    float above = mix(far_at(low, result), far_at(ivec2(high.x, low.y), result), more.x);
    float below = mix(far_at(ivec2(low.x, high.y), result), far_at(high, result), more.x);
    sum += mix(above, below, more.y);
#ifdef BESIDES
    sum += besides[(result * image.y + pixel.y) * image.x + pixel.x];
#endif
    return factor * sum;
}

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(texel, imageSize(target_image)))) return;
    vec4 value = vec4(0.0);
#ifdef MOSAIC
    for (int i = 0; i < 4; ++i) {
        ivec2 pixel = ivec2(4 * texel.x + i, texel.y);
        int result = results[2 * (pixel.y % 2) + pixel.x % 2];
        if (pixel.x < image.x - 2 * margin) value[i] = light(pixel + margin, result);
    }
    if (adds != 0) value += imageLoad(target_image, texel);
#else
    for (int result = 0; result < 4; ++result) value[result] = light(texel + margin, result);
#endif
    imageStore(target_image, texel, value);
}
