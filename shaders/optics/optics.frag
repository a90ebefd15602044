// Mean photo-electrons of each pixel from the radiance that it sees.
//
// Image irradiance of a lens: E = pi L T cos^4(theta) / (4 N^2), L in W m-2 sr-1 per band; electrons
// = E * area * time * photons per joule * quantum efficiency, folded per band into
// electrons_per_radiance [e- W-1 m2 sr].
#include "block/optics"

uniform sampler2D radiance;

out float electrons;

void main() {
    vec2 tangent = (gl_FragCoord.xy - intrinsics.zw) / intrinsics.xy;
    float cos2 = 1.0 / (1.0 + dot(tangent, tangent));
    vec4 L = texelFetch(radiance, ivec2(gl_FragCoord.xy), 0);
    electrons = dot(L, electrons_per_radiance) * cos2 * cos2;
}
