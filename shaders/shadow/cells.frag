// Nearest depth in each square cell of 8 x 8 texels.
uniform sampler2D source;

out float nearest;

void main() {
    ivec2 first = ivec2(gl_FragCoord.xy) * 8;
    nearest = 1.0;
    for (int j = 0; j < 8; ++j)
        for (int i = 0; i < 8; ++i)
            nearest = min(nearest, texelFetch(source, first + ivec2(i, j), 0).r);
}
