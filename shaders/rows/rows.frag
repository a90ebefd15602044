// What the rows of an image see; with ROW_SHARES during shares of their exposures, with LESS beyond what
// is behind it.

uniform sampler2D seen;
#ifdef ROW_SHARES
// Of each row's exposure time.
uniform sampler2D row_shares;
#endif
#ifdef LESS
uniform sampler2D behind;
#endif

out vec4 radiance;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    radiance = texelFetch(seen, pixel, 0);
#ifdef LESS
    radiance -= texelFetch(behind, pixel, 0);
#endif
#ifdef ROW_SHARES
    radiance *= texelFetch(row_shares, ivec2(0, pixel.y), 0).r;
#endif
}
