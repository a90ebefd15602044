// Mean photo-electrons of each pixel from the irradiance of the image plane [W m-2 per band].
//
// Electrons = E * area * time * photons per joule * quantum efficiency, all of it folded per band
// into electrons_per_irradiance [e- W-1 m2].
#include "block/exposure"

uniform sampler2D irradiance;

out float electrons;

void main() {
    electrons = dot(texelFetch(irradiance, ivec2(gl_FragCoord.xy), 0), electrons_per_irradiance);
}
