// Bounds on the depth of casters, so that a receiver need not look where none can matter: nearest
// and farthest. From left to right: in and next to each cell of 8 texels; in and next to each cell
// of 64; and for each cell of 64 wherever a caster can stand between a receiver in it and the Sun's
// disc.
#include "block/tops"

uniform sampler2D fine;     // nearest and farthest depth in cells of 8 texels
uniform sampler2D coarse;   // in cells of 64

out vec2 bounds;

vec2 joined(vec2 a, vec2 b) {
    return vec2(min(a.x, b.x), max(a.y, b.y));
}

vec2 around(sampler2D cells, ivec2 at) {
    ivec2 last = textureSize(cells, 0) - 1;
    vec2 depths = vec2(1.0, 0.0);
    for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i)
            depths = joined(depths, texelFetch(cells, clamp(at + ivec2(i, j), ivec2(0), last), 0).rg);
    return depths;
}

// Light reaches a receiver through a cone, so that a caster matters out to a distance that grows with
// its height; the map's bottom is the lowest that a receiver can be.
vec2 in_cone(ivec2 at) {
    int last = textureSize(coarse, 0).x - 1;
    int reach = min(int(full_reach / 64.0) + 2, last);
    vec2 depths = vec2(1.0, 0.0);
    for (int j = max(at.y - reach, 0); j <= min(at.y + reach, last); ++j)
        for (int i = max(at.x - reach, 0); i <= min(at.x + reach, last); ++i) {
            vec2 cell = texelFetch(coarse, ivec2(i, j), 0).rg;
            float gap = 64.0 * float(max(max(abs(i - at.x), abs(j - at.y)) - 1, 0));
            if (gap <= full_reach * (1.0 - cell.x) + 1.0) depths = joined(depths, cell);
        }
    return depths;
}

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy) - ivec2(int(first_column), 0);
    int first = textureSize(fine, 0).x, second = textureSize(coarse, 0).x;
    if (at.x < first) bounds = around(fine, at);
    else if (at.y >= second) bounds = vec2(1.0);
    else if (at.x < first + second) bounds = around(coarse, at - ivec2(first, 0));
    else bounds = in_cone(at - ivec2(first + second, 0));
}
