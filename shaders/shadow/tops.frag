// Bounds on how high casters stand, so that a receiver need not look for higher ones. From left to
// right: the highest caster in and next to each cell of 8 texels; in and next to each cell of 64; and
// for each cell of 64 the highest that a receiver anywhere in it can have between itself and the
// Sun's disc.
#include "block/tops"

uniform sampler2D fine;     // nearest depth in cells of 8 texels
uniform sampler2D coarse;   // in cells of 64

out float nearest;

float around(sampler2D cells, ivec2 at) {
    ivec2 last = textureSize(cells, 0) - 1;
    float depth = 1.0;
    for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i)
            depth = min(depth, texelFetch(cells, clamp(at + ivec2(i, j), ivec2(0), last), 0).r);
    return depth;
}

// Light reaches a receiver through a cone, so that a caster matters out to a distance that grows with
// its height; the map's bottom is the lowest that a receiver can be.
float in_cone(ivec2 at) {
    int last = textureSize(coarse, 0).x - 1;
    int reach = min(int(full_reach / 64.0) + 2, last);
    float depth = 1.0;
    for (int j = max(at.y - reach, 0); j <= min(at.y + reach, last); ++j)
        for (int i = max(at.x - reach, 0); i <= min(at.x + reach, last); ++i) {
            float d = texelFetch(coarse, ivec2(i, j), 0).r;
            float gap = 64.0 * float(max(max(abs(i - at.x), abs(j - at.y)) - 1, 0));
            if (gap <= full_reach * (1.0 - d) + 1.0) depth = min(depth, d);
        }
    return depth;
}

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    int first = textureSize(fine, 0).x, second = textureSize(coarse, 0).x;
    if (at.x < first) nearest = around(fine, at);
    else if (at.y >= second) nearest = 1.0;
    else if (at.x < first + second) nearest = around(coarse, at - ivec2(first, 0));
    else nearest = in_cone(at - ivec2(first + second, 0));
}
