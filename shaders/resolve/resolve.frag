// Spacecraft samples of a tile averaged over each pixel and laid over what is behind them. The mean
// over all samples of the pixel goes out as colour, the covered share as the second source, so that
// blending computes mean + (1 - share) * background in float32.
#include "block/resolve"
#ifdef DISTORTED
#include "common/distortion.glsl"

// Coordinates in the pinhole's picture that the middles of the pixels see.
uniform sampler2D places;
#endif

uniform sampler2D samples;

layout(location = 0, index = 0) out vec4 radiance;
layout(location = 0, index = 1) out vec4 share;

// The middle of this pixel in coordinates of the tile [pixels].
vec2 middle() {
#ifdef DISTORTED
    return texelFetch(places, ivec2(gl_FragCoord.xy), 0).xy - tile_origin;
#else
    return gl_FragCoord.xy - tile_origin;
#endif
}

// The pixel that collects what lies at a place of the tile.
vec2 pixel_of(vec2 place) {
#ifdef DISTORTED
    vec2 tangent = (place + tile_origin - pinhole_middle) / focal_length_px;
    return floor(distorted(tangent, radial, rational) * focal_length_px + picture_middle);
#else
    return floor(place) + tile_origin;
#endif
}

void main() {
    mat2 to_raster = mat2(raster_from_pixel.xy, raster_from_pixel.zw);
    mat2 to_pixel = mat2(pixel_from_raster.xy, pixel_from_raster.zw);
    vec2 pixel = floor(gl_FragCoord.xy);
    ivec2 centre = ivec2(floor(to_raster * middle() + raster_origin));
    ivec2 last = textureSize(samples, 0) - 1;
    vec4 sum = vec4(0.0);
    float count = 0.0, covered = 0.0;
    for (int j = -reach; j <= reach; ++j) {
        for (int i = -reach; i <= reach; ++i) {
            ivec2 texel = centre + ivec2(i, j);
            // From the texel alone, so that neighbouring pixels agree on whose sample it is.
            vec2 place = to_pixel * (vec2(texel) + 0.5 - raster_origin);
            if (pixel_of(place) != pixel) continue;
            count += 1.0;
            vec4 L = texelFetch(samples, clamp(texel, ivec2(0), last), 0);
            if (L.r >= 0.0) {
                sum += L;
                covered += 1.0;
            }
        }
    }
    radiance = sum / max(count, 1.0);
    share = vec4(covered / max(count, 1.0));
}
