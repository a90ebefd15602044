// Bounds on the depth of casters, so that a receiver need not look where none can matter: nearest
// and farthest of four squares of cells, which together make a larger one; or, with CONE, wherever a
// caster can stand between a receiver in the cell and the Sun's disc.
#include "block/tops"
#include "common/texels.glsl"

uniform sampler2D cells;   // nearest and farthest depth; with CONE in cells of 64 texels

out vec2 bounds;

vec2 joined(vec2 a, vec2 b) {
    return vec2(min(a.x, b.x), max(a.y, b.y));
}

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy) - ivec2(int(first_column), 0);
    ivec2 last = textureSize(cells, 0) - 1;
#ifdef CONE
    // Light reaches a receiver through a cone, so that a caster matters out to a distance that grows
    // with its height; the map's bottom is the lowest that a receiver can be.
    bounds = vec2(1.0, 0.0);
    int reach = min(int(full_reach / 64.0) + 2, last.x);
    for (int j = max(at.y - reach, 0); j <= min(at.y + reach, last.y); ++j)
        for (int i = max(at.x - reach, 0); i <= min(at.x + reach, last.x); ++i) {
            vec2 cell = read_texel(cells, ivec2(i, j)).rg;
            float gap = 64.0 * float(max(max(abs(i - at.x), abs(j - at.y)) - 1, 0));
            if (gap > full_reach * (1.0 - cell.x) + 1.0) continue;
            bounds = joined(bounds, cell);
        }
#else
    ivec2 low = max(at + int(square_low), ivec2(0)), high = min(at + int(square_high), last);
    bounds = joined(joined(read_texel(cells, low).rg, read_texel(cells, high).rg),
                    joined(read_texel(cells, ivec2(low.x, high.y)).rg,
                           read_texel(cells, ivec2(high.x, low.y)).rg));
#endif
}
