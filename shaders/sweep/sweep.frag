// What pixels see while the shutter is open, from a picture of a moment and the ways of what it shows: the
// mean over the exposure of the places of the picture that come past a pixel.
//
// Along the longer axis of the motion the places lie a pixel apart, so that at an even motion no pixel of
// the picture is read between its middle and the next one's, and nothing gets wider than it should. The
// places at both ends count in part, so that the variance of all is that of the motion.
// CHUNKS: the picture is one that was swept already, over an equal part of the exposure.
#include "block/sweep"

uniform sampler2D picture;   // read with linear interpolation
uniform sampler2D paths;     // v and a [px]: t exposure times ago it was t v - t^2 a before

out vec4 radiance;

void main() {
    vec2 at = gl_FragCoord.xy + margin;
    vec2 size = vec2(textureSize(paths, 0));
    vec4 path = texture(paths, ((at - nodes_origin) / nodes_step + 0.5) / size);
    // The part of the row's exposure that this picture stands for, exposure times from its own moment.
    float opens = (gl_FragCoord.y - middle_row) * row_rate - 0.5;
    float from = max(opens, segment.x), to = min(opens + 1.0, segment.y);
    float span = max(to - from, 0.0), middle = 0.5 * (from + to) - moment;
    float longest = abs(middle) + 0.5 * span;
    vec2 texel = 1.0 / vec2(textureSize(picture, 0));
#define SEEN(t) texture(picture, (at - (t) * path.xy + min((t) * (t), longest * longest) * path.zw) * texel)
#ifdef CHUNKS
    vec4 sum = vec4(0.0);
    float between = span / float(count);
    int i = 0;
    do {
        float t = middle + (float(i) + 0.5) * between - 0.5 * span;
        sum += SEEN(t);
    } while (++i < count);
    radiance = sum * (span * share / float(count));
#else
    float speed = max(max(abs(path.x), abs(path.y)), 1e-6), way = span * speed;
    // Places on either side, and the weight of the last one.
    float last = max(ceil(0.5 * (sqrt(way * way + 1.0) - 1.0)), 1.0);
    float inner = (last - 1.0) * last * (2.0 * last - 1.0) / 6.0;
    float weight = (way * way * (2.0 * last - 1.0) / 12.0 - 2.0 * inner) / (2.0 * last * last - way * way / 6.0);
    vec4 sum = SEEN(middle);
    float i = 1.0;
    do {
        float before = middle - i / speed, after = middle + i / speed;
        sum += (i < last ? 1.0 : i > last ? 0.0 : weight) * (SEEN(before) + SEEN(after));
    } while (++i <= float(count));
    radiance = sum * (span * share / (2.0 * last - 1.0 + 2.0 * weight));
#endif
}
