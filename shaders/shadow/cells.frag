// Nearest and farthest depth in each square cell of texels, or of smaller cells.
#include "block/tops"

uniform sampler2D source;

out vec2 bounds;

void main() {
    int across = int(cell_across);
    ivec2 first = ivec2(gl_FragCoord.xy) * across + ivec2(int(first_column), 0);
    bounds = vec2(1.0, 0.0);
    for (int j = 0; j < across; ++j)
        for (int i = 0; i < across; ++i) {
            vec2 texel = texelFetch(source, first + ivec2(i, j), 0).rg;
            bounds.x = min(bounds.x, texel.x);
            bounds.y = max(bounds.y, from_map > 0.5 ? texel.x : texel.y);
        }
}
