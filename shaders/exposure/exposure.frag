// Mean photo-electrons of each pixel from the irradiance of the image plane [W m-2 per band].
//
// Electrons = E * area * time * photons per joule * quantum efficiency, all of it folded per band
// into electrons_per_irradiance [e- W-1 m2]: one row for each pixel of a square of 2 x 2, in the order
// (0, 0), (1, 0), (0, 1), (1, 1), which are alike without colour filters.
#include "block/exposure"

uniform sampler2D irradiance;
#ifdef ROW_SHARES
// Of each row's exposure time, the share during which the scene looked like this.
uniform sampler2D row_shares;
#endif

out float electrons;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 square = electrons_per_irradiance * texelFetch(irradiance, pixel, 0);
#ifdef MOSAIC
    vec2 line = (pixel.y & 1) == 0 ? square.xy : square.zw;
    electrons = (pixel.x & 1) == 0 ? line.x : line.y;
#else
    electrons = square.x;
#endif
#ifdef ROW_SHARES
    electrons *= texelFetch(row_shares, ivec2(0, pixel.y), 0).r;
#endif
}
