// What pixels see while the shutter is open, from a snapshot of a moment and the ways of what it shows: the
// mean over the exposure of the places of the snapshot that come past a pixel.
//
// Along the longer axis of the motion the places lie a pixel apart, so that an even motion reads pixels of
// the snapshot at their middles, and nothing gets wider along it than it should. The places at both ends
// count in part, so that the variance of all is that of the motion.
//
// CHUNKS: the snapshot is one that was swept already, over an equal part of the exposure.
// FINE: what is between pixels across the motion is told from four of them, so that edges along it stay
// as sharp as they are.
// OFF_CENTRE: it shows another part of the exposure than that around its moment, and what is seen in the middle of
// it stood between pixels; FINE as well. Neighbours along the motion are parted by linear interpolation.
// UNEVEN: what it shows accelerates, and may turn back on its way. Each place, a pixel from the next along
// the longer axis, counts for the time that is spent around it, parted between neighbours as by linear
// interpolation; FINE as well.
// COVERED: it comes with the covered share of its pixels.
// OVER: that is the second source, so that blending lays the snapshot over what is behind it.
#include "block/sweep"

uniform sampler2D snapshot;   // read with linear interpolation
uniform sampler2D paths;     // v and a [px]: t exposure times ago it was t v - t^2 a before
#ifdef COVERED
uniform sampler2D covered;
#endif

layout(location = 0, index = 0) out vec4 radiance;
#ifdef OVER
layout(location = 0, index = 1) out vec4 share_covered;
#elif defined(COVERED)
layout(location = 1) out vec4 share_covered;
#endif

// Light, and the covered share.
#ifdef COVERED
#define Seen mat2x4
#define SEEN(place) mat2x4(texture(snapshot, place), texture(covered, place))
#else
#define Seen vec4
#define SEEN(place) texture(snapshot, place)
#endif

#ifdef FINE
// What a part of a pixel, on the side of the one before, has of its light. An edge in it, told by its
// neighbours, parts what is as these are; a pixel that is brighter or darker than both is even. Pixels
// that are moved so keep all light, nothing gets negative, and edges keep their width.
vec4 part_of(vec4 before, vec4 pixel, vec4 after, float part) {
    vec4 rise = after - before, last = rise * part - (after - pixel);
    vec4 edge = before * part + mix(min(last, vec4(0.0)), max(last, vec4(0.0)), greaterThan(rise, vec4(0.0)));
    return mix(pixel * part, edge, greaterThan((pixel - before) * (after - pixel), vec4(0.0)));
}

// A share of the way from a pixel to the next one.
vec4 between(vec4 before, vec4 low, vec4 high, vec4 after, float part) {
    // Not less than 0, to which rounding leads.
    return max(low - part_of(before, low, high, part) + part_of(low, high, after, part), vec4(0.0));
}

vec4 fine(sampler2D from, ivec2 pixel, ivec2 across, ivec2 end, float part) {
    return between(texelFetch(from, clamp(pixel - across, ivec2(0), end), 0),
                   texelFetch(from, clamp(pixel, ivec2(0), end), 0),
                   texelFetch(from, clamp(pixel + across, ivec2(0), end), 0),
                   texelFetch(from, clamp(pixel + 2 * across, ivec2(0), end), 0), part);
}

// At a place of a snapshot [px], which lies in the middle of a row, or column, across the motion.
Seen fine_at(vec2 place, ivec2 across) {
    ivec2 end = textureSize(snapshot, 0) - 1;
    vec2 corner = place - 0.5 * vec2(across);
    ivec2 pixel = ivec2(floor(corner));
    float part = dot(corner - floor(corner), vec2(across));
#ifdef COVERED
    return mat2x4(fine(snapshot, pixel, across, end, part), fine(covered, pixel, across, end, part));
#else
    return fine(snapshot, pixel, across, end, part);
#endif
}

// The same anywhere along the motion.
Seen fine_off_centre(vec2 place, ivec2 across) {
    vec2 along = vec2(across.yx);
    float part = dot(fract(place - 0.5), along);
    vec2 low = place - part * along;
    return (1.0 - part) * fine_at(low, across) + part * fine_at(low + along, across);
}

#ifdef OFF_CENTRE
#define FINE_AT fine_off_centre
#else
#define FINE_AT fine_at
#endif
#endif

#ifdef UNEVEN
#ifdef FINE
#define SEEN_ALONG(place) FINE_AT(place, along.yx)
#else
#define SEEN_ALONG(place) SEEN((place) / vec2(textureSize(snapshot, 0)))
#endif

// When what goes by rate t - bend t^2 along an axis, bend > 0, is at a level: on its way there, and back.
//
// half_span : times run from minus that to that; turns : when it turns back, within these
vec2 times_at(float level, float rate, float bend, float half_span, float turns) {
    level = min(level, 0.25 * rate * rate / bend);
    float root = sqrt(max(rate * rate - 4.0 * bend * level, 0.0));
    // Of the two forms of each root that which loses no digits.
    float sum = abs(rate) + root, near = 2.0 * level / max(sum, 1e-9), far = 0.5 * sum / bend;
    vec2 times = rate > 0.0 ? vec2(near, far) : vec2(-far, -near);
    return vec2(clamp(times.x, -half_span, turns), clamp(times.y, turns, half_span));
}

// Sum of the levels from one time to another.
vec2 sum_between(vec2 from, vec2 to, float rate, float bend) {
    return (to - from) * (0.5 * rate * (from + to) - bend / 3.0 * (from * from + from * to + to * to));
}

// Mean over times of an exposure about 0 of the snapshot at `place` - t (way - t curve) [px].
Seen uneven(vec2 place, vec2 way, vec2 curve, float span) {
    float half_span = 0.5 * span;
    vec2 reach = abs(way) + abs(curve) * half_span;
    bool upright = reach.y > reach.x;
    ivec2 along = upright ? ivec2(0, 1) : ivec2(1, 0);
    // Levels count so that the bend is positive.
    vec2 rates = upright ? way.yx : way, bends = upright ? curve.yx : curve;
    float forwards = bends.x < 0.0 ? -1.0 : 1.0;
    float rate = forwards * rates.x, bend = max(abs(bends.x), 1e-3);
    float turns = clamp(0.5 * rate / bend, -half_span, half_span);
    vec2 ends = half_span * (rate * vec2(-1.0, 1.0) - bend * half_span);
    float top = turns * (rate - turns * bend);
    float level = floor(min(ends.x, ends.y)), last = ceil(max(top, max(ends.x, ends.y)));
    // Only as far as there is something to read.
    vec2 full = forwards * ((upright ? place.yy : place.xx) - (upright ? filled.yw : filled.xz));
    level = max(level, floor(min(full.x, full.y)));
    last = min(last, ceil(max(full.x, full.y)));
    vec2 low = times_at(level - 1.0, rate, bend, half_span, turns);
    vec2 middle = times_at(level, rate, bend, half_span, turns);
    Seen sum = Seen(0.0);
    do {
        vec2 high = times_at(level + 1.0, rate, bend, half_span, turns);
        // Time spent below, above, on the way there and back; from there back time runs down with the level.
        vec2 weights = abs(sum_between(low, middle, rate, bend) - (level - 1.0) * (middle - low)
                           - sum_between(middle, high, rate, bend) + (level + 1.0) * (high - middle));
        // Across the axis, at the times' middles.
        vec2 times = 0.5 * (low + high);
        vec2 lateral = times * (rates.y - times * bends.y);
        float weight = weights.x + weights.y, both = dot(weights, lateral) / max(weight, 1e-9);
        bool differ = abs(lateral.x - lateral.y) > 0.125 && min(weights.x, weights.y) > 0.0;
        vec2 along_path = forwards * level * vec2(along), across_path = vec2(along.yx);
        float first = differ ? lateral.x : both;
        sum += (differ ? weights.x : weight) * SEEN_ALONG(place - along_path - first * across_path);
        if (differ) sum += weights.y * SEEN_ALONG(place - along_path - lateral.y * across_path);
        low = middle;
        middle = high;
    } while (++level <= last);
    return (1.0 / max(span, 1e-9)) * sum;
}
#endif

void main() {
    vec2 at = gl_FragCoord.xy + margin;
    vec2 size = vec2(textureSize(paths, 0));
    vec4 path = texture(paths, ((at - nodes_origin) / nodes_step + 0.5) / size);
    // The part of the row's exposure that this snapshot stands for, exposure times from its own moment.
    float opens = (gl_FragCoord.y - middle_row) * row_rate - 0.5;
    float from = max(opens, segment.x), to = min(opens + 1.0, segment.y);
    float span = max(to - from, 0.0), middle = 0.5 * (from + to) - moment;
    // What it moves by in a unit of time about the middle.
    vec2 late = middle * path.zw, rate = path.xy - 2.0 * late;
#ifdef UNEVEN
    Seen sum = share * span * uneven(at - middle * (path.xy - late), rate, path.zw, span);
#else
#ifdef FINE
    vec2 texel = vec2(1.0);
    ivec2 across = abs(rate.x) < abs(rate.y) ? ivec2(1, 0) : ivec2(0, 1);
#undef SEEN
#define SEEN(place) FINE_AT(place, across)
#else
    vec2 texel = 1.0 / vec2(textureSize(snapshot, 0));
#endif
    // What is seen in the middle, and a unit of time before.
    vec2 place = (at - middle * (path.xy - late)) * texel;
    vec2 before = rate * texel, curve = path.zw * texel;
    Seen sum;
#ifdef CHUNKS
    float between = span / float(count), t = 0.5 * (between - span);
    sum = SEEN(place - t * (before - t * curve));
    int left = count;
    while (--left > 0) {
        t += between;
        sum += SEEN(place - t * (before - t * curve));
    }
    sum *= span * share / float(count);
#else
    float speed = max(max(abs(rate.x), abs(rate.y)), 1e-6), length = span * speed;
    // Places on either side, and the weight of the last one.
    float last = max(ceil(0.5 * (sqrt(length * length + 1.0) - 1.0)), 1.0);
    float inner = (last - 1.0) * last * (2.0 * last - 1.0) / 6.0;
    float weight = (length * length * (2.0 * last - 1.0) / 12.0 - 2.0 * inner)
                 / (2.0 * last * last - length * length / 6.0);
    before /= speed;
    // Where next to nothing moves, a step is more than the whole exposure.
    curve *= min(1.0 / (speed * speed), span * span);
#ifdef FINE
    // Places are whole pixels apart, as far on either side: weights put their middle where it belongs.
    float lag = dot(curve * before, vec2(across.yx));
    curve -= lag * before;
#ifdef OFF_CENTRE
    sum = SEEN(place);
#else
    // The middle lies in a pixel's.
    ivec2 here = ivec2(place);
#ifdef COVERED
    sum = mat2x4(texelFetch(snapshot, here, 0), texelFetch(covered, here, 0));
#else
    sum = texelFetch(snapshot, here, 0);
#endif
#endif
#else
    sum = SEEN(place);
#endif
    float i = 1.0;
    do {
        Seen ago = SEEN(place - i * (before - i * curve)), next = SEEN(place + i * (before + i * curve));
#ifdef FINE
        float later = clamp(i * lag, -1.0, 1.0);
        Seen both = (1.0 - later) * ago + (1.0 + later) * next;
#else
        Seen both = ago + next;
#endif
        sum += (i < last ? 1.0 : i > last ? 0.0 : weight) * both;
    } while (++i <= float(count));
    sum *= span * share / (2.0 * last - 1.0 + 2.0 * weight);
#endif
#endif
#ifdef COVERED
    radiance = sum[0];
    share_covered = sum[1];
#else
    radiance = sum;
#endif
}
