// A distorted image from a finer one without distortion: the mean over a pixel of what its lines of
// sight meet. Places with linear interpolation between the fine pixels stand for the pixel, in rows
// and columns that lie hardly farther apart than fine pixels, so that none is passed over.
#include "block/warp"

uniform sampler2D places;
uniform sampler2D fine;

out vec4 radiance;

// Fine pixels from one place to the next, and the most rows of places; as in simgl/camera/distortion.py,
// which knows what share of a star's light that keeps.
const float SPACING = 1.15;
const float MAX_SAMPLES = 8.0;

vec2 place(ivec2 pixel) {
    return texelFetch(places, clamp(pixel, ivec2(0), textureSize(places, 0) - 1), 0).xy;
}

float rows_along(vec2 step) {
    return clamp(ceil(length(step) * fine_per_pixel / SPACING), 2.0, MAX_SAMPLES);
}

// Linear interpolation between fine pixels. Hardware filters round its weights to 1/256, which moves
// the light of stars by 0.2 %.
vec4 fine_at(vec2 at) {
    vec2 corner = floor(at - 0.5), weight = at - 0.5 - corner;
    ivec2 last = textureSize(fine, 0) - 1;
    ivec2 low = clamp(ivec2(corner), ivec2(0), last), high = clamp(ivec2(corner) + 1, ivec2(0), last);
    vec4 above = mix(texelFetch(fine, low, 0), texelFetch(fine, ivec2(high.x, low.y), 0), weight.x);
    vec4 below = mix(texelFetch(fine, ivec2(low.x, high.y), 0), texelFetch(fine, high, 0), weight.x);
    return mix(above, below, weight.y);
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    if (texelFetch(places, pixel, 0).z == 0.0) discard;   // drawn through another pinhole, or not at all
    vec2 middle = place(pixel);
    // At the edges the difference is one-sided.
    ivec2 last = textureSize(places, 0) - 1;
    vec2 span = vec2(min(pixel + 1, last) - max(pixel - 1, 0));
    vec2 across = (place(pixel + ivec2(1, 0)) - place(pixel - ivec2(1, 0))) / max(span.x, 1.0);
    vec2 down = (place(pixel + ivec2(0, 1)) - place(pixel - ivec2(0, 1))) / max(span.y, 1.0);
    float columns = rows_along(across), rows = rows_along(down);
    vec4 sum = vec4(0.0);
    for (float j = 0.5; j < rows; ++j) {
        for (float i = 0.5; i < columns; ++i) {
            vec2 at = middle + (i / columns - 0.5) * across + (j / rows - 0.5) * down;
            sum += fine_at(at * fine_per_pixel);
        }
    }
    radiance = sum / (rows * columns);
}
