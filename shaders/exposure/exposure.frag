// Mean photo-electrons of each pixel from the irradiance of the image plane [W m-2 per band].
//
// Electrons = E * area * time * photons per joule * quantum efficiency, all of it folded per band
// into electrons_per_irradiance [e- W-1 m2]: of a square of 2 x 2 pixels under colour filters, column
// first, or of every pixel alike.
#include "block/exposure"

uniform sampler2D irradiance;
#ifdef ROW_SHARES
// Of each row's exposure time, the share during which the scene looked like this.
uniform sampler2D row_shares;
#endif

out float electrons;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 weight = electrons_per_irradiance[0];
#ifdef MOSAIC
    bvec2 odd = notEqual(pixel & 1, ivec2(0));
    vec4 upper = odd.x ? electrons_per_irradiance[1] : weight;
    vec4 lower = odd.x ? electrons_per_irradiance[3] : electrons_per_irradiance[2];
    weight = odd.y ? lower : upper;
#endif
    electrons = dot(texelFetch(irradiance, pixel, 0), weight);
#ifdef ROW_SHARES
    electrons *= texelFetch(row_shares, ivec2(0, pixel.y), 0).r;
#endif
}
