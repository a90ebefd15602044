// Nearest and farthest depth in each square of 8 x 8 texels of a map, or of smaller squares.
#include "block/tops"
#include "common/texels.glsl"

uniform sampler2D source;   // depths and nothing; or nearest and farthest

out vec2 bounds;

void main() {
    ivec2 first = 8 * ivec2(gl_FragCoord.xy) + ivec2(int(first_column), 0);
    vec2 width = 1.0 / vec2(textureSize(source, 0));
    bounds = vec2(1.0, 0.0);
    for (int j = 0; j < 8; ++j)
        for (int i = 0; i < 8; ++i) {
            vec2 texel = read_texel(source, first + ivec2(i, j), width).rg;
            bounds.x = min(bounds.x, texel.x);
            bounds.y = max(bounds.y, max(texel.x, texel.y));
        }
}
