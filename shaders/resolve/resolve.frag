// Spacecraft samples of a tile averaged over each pixel and laid over what is behind them. The mean
// over the covered samples' share goes out as colour, the share itself as the second source, so that
// blending computes mean + (1 - share) * background in float32.
#include "block/resolve"

uniform sampler2D samples;

layout(location = 0, index = 0) out vec4 radiance;
layout(location = 0, index = 1) out vec4 share;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy) - tile_origin.xy;
    ivec2 centre = ivec2(raster.x * pixel.x + raster.y * pixel.y,
                         raster.x * pixel.y - raster.y * pixel.x) + raster.zw;
    vec4 sum = vec4(0.0);
    float covered = 0.0;
    for (int k = 0; k < sample_count; k += 2) {
        // Two texel offsets travel in one ivec4.
        ivec4 pair = sample_offsets[k >> 1];
        vec4 first = texelFetch(samples, centre + pair.xy, 0);
        if (first.r >= 0.0) {
            sum += first;
            covered += 1.0;
        }
        if (k + 1 < sample_count) {
            vec4 second = texelFetch(samples, centre + pair.zw, 0);
            if (second.r >= 0.0) {
                sum += second;
                covered += 1.0;
            }
        }
    }
    radiance = sum / float(sample_count);
    share = vec4(covered / float(sample_count));
}
