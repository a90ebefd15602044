// Spacecraft samples of a tile averaged over each pixel and laid over what is behind them. The mean
// over all samples of the pixel goes out as colour, the covered share as the second source, so that
// blending computes mean + (1 - share) * background in float32.
//
// WINDOW: the raster covers small spacecraft alone; a pixel's other samples are known to be empty.
#include "block/resolve"

uniform sampler2D samples;
#ifdef DISTORTED
// Coordinates in the pinhole's image that the middles of the pixels see.
uniform sampler2D places;

vec2 place(ivec2 pixel) {
    return texelFetch(places, pixel, 0).xy;
}

// What one pixel to the right, and one down, is in the pinhole's image; one-sided at the edges.
mat2 pixel_edges(ivec2 pixel) {
    ivec2 low = max(pixel - 1, 0), high = min(pixel + 1, textureSize(places, 0) - 1);
    vec2 across = place(ivec2(high.x, pixel.y)) - place(ivec2(low.x, pixel.y));
    vec2 down = place(ivec2(pixel.x, high.y)) - place(ivec2(pixel.x, low.y));
    vec2 span = vec2(max(high - low, 1));
    return mat2(across / span.x, down / span.y);
}
#endif

layout(location = 0, index = 0) out vec4 radiance;
layout(location = 0, index = 1) out vec4 share;

#ifdef WINDOW
void main() {
    vec2 corner = floor(gl_FragCoord.xy) - tile_origin;
    mat2 to_pixel = mat2(pixel_from_raster.xy, pixel_from_raster.zw);
    float count = window_samples;
#ifdef DISTORTED
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    mat2 edges = pixel_edges(pixel), to_edges = inverse(edges);
    vec2 middle = place(pixel) - tile_origin;
    count *= abs(determinant(edges));
#endif
    vec4 sum = vec4(0.0);
    float covered = 0.0;
    for (int j = 0; j < window_size.y; ++j) {
        vec4 row = vec4(0.0);
        for (int i = 0; i < window_size.x; ++i) {
            vec2 seen = to_pixel * (vec2(i, j) + 0.5) + window_origin;
#ifdef DISTORTED
            if (any(greaterThan(abs(to_edges * (seen - middle)), vec2(0.5)))) continue;
#else
            if (floor(seen) != corner) continue;
#endif
            vec4 L = texelFetch(samples, ivec2(i, j), 0);
            if (L.r >= 0.0) {
                row += L;
                covered += 1.0;
            }
        }
        sum += row;
    }
    radiance = sum / count;
    share = vec4(covered / count);
}
#else
void main() {
    mat2 to_raster = mat2(raster_from_pixel.xy, raster_from_pixel.zw);
    vec2 corner = floor(gl_FragCoord.xy) - tile_origin;
#ifdef DISTORTED
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 seen = place(pixel);
    // Neighbouring parts of a tile overlap; each pixel belongs to one of them.
    if (any(lessThan(seen, owned.xy)) || any(greaterThanEqual(seen, owned.zw))) discard;
    vec2 middle = to_raster * (seen - tile_origin) + raster_origin;
    // A pixel is small beside the curvature of the distortion: its edges are straight.
    to_raster = to_raster * pixel_edges(pixel);
    mat2 to_pixel = inverse(to_raster);
    vec2 extent = 0.5 * (abs(to_raster[0]) + abs(to_raster[1]));
    int reach = int(ceil(max(extent.x, extent.y) + 0.5));
#else
    mat2 to_pixel = mat2(pixel_from_raster.xy, pixel_from_raster.zw);
    vec2 middle = to_raster * (corner + 0.5) + raster_origin;
    int reach = pinhole_reach;
#endif
    ivec2 centre = ivec2(floor(middle));
    ivec2 last = raster_size - 1;
    vec4 sum = vec4(0.0);
    float count = 0.0, covered = 0.0;
    for (int j = -reach; j <= reach; ++j) {
        // Row by row: thousands of samples added to one float32 would lose its last digits.
        vec4 row = vec4(0.0);
        for (int i = -reach; i <= reach; ++i) {
            ivec2 texel = centre + ivec2(i, j);
#ifdef DISTORTED
            if (any(greaterThan(abs(to_pixel * (vec2(texel) + 0.5 - middle)), vec2(0.5)))) continue;
#else
            // From the texel alone, so that neighbouring pixels agree on whose sample it is.
            vec2 place = floor(to_pixel * (vec2(texel) + 0.5 - raster_origin));
            if (place != corner) continue;
#endif
            count += 1.0;
#ifdef DISTORTED
            // Past the raster the spacecraft of the tile have nothing.
            if (any(lessThan(texel, ivec2(0))) || any(greaterThan(texel, last))) continue;
            vec4 L = texelFetch(samples, texel, 0);
#else
            vec4 L = texelFetch(samples, clamp(texel, ivec2(0), last), 0);
#endif
            if (L.r >= 0.0) {
                row += L;
                covered += 1.0;
            }
        }
        sum += row;
    }
    radiance = sum / max(count, 1.0);
    // Drivers divide to the last digit but one, through which the Sun's disc would shine.
    share = vec4(covered < count ? covered / count : min(count, 1.0));
}
#endif
