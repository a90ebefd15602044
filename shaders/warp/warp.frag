// A distorted picture from a finer one without distortion: the mean over a pixel of what its lines of
// sight meet. Four places with linear interpolation between the fine pixels stand for the pixel.
#include "block/warp"

uniform sampler2D places;
uniform sampler2D fine;

out vec4 radiance;

vec2 place(ivec2 pixel) {
    return texelFetch(places, clamp(pixel, ivec2(0), textureSize(places, 0) - 1), 0).xy;
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 middle = place(pixel);
    // At the edges the difference is one-sided.
    ivec2 last = textureSize(places, 0) - 1;
    vec2 span = vec2(min(pixel + 1, last) - max(pixel - 1, 0));
    vec2 across = (place(pixel + ivec2(1, 0)) - place(pixel - ivec2(1, 0))) / max(span.x, 1.0);
    vec2 down = (place(pixel + ivec2(0, 1)) - place(pixel - ivec2(0, 1))) / max(span.y, 1.0);
    vec2 to_texture = fine_per_pixel / vec2(textureSize(fine, 0));
    vec4 sum = vec4(0.0);
    for (int j = -1; j <= 1; j += 2) {
        for (int i = -1; i <= 1; i += 2) {
            vec2 at = middle + 0.25 * (float(i) * across + float(j) * down);
            sum += textureLod(fine, at * to_texture, 0.0);
        }
    }
    radiance = 0.25 * sum;
}
