// Irradiance of the image plane from the radiance that each pixel sees, W m-2 per band.
//
// A lens gives E = pi L T cos^4(theta) / (4 N^2), all of it but the cosine folded per band into
// irradiance_per_radiance [sr].
#include "block/optics"

uniform sampler2D radiance;

out vec4 irradiance;

void main() {
    vec2 tangent = (gl_FragCoord.xy - intrinsics.zw) / intrinsics.xy;
    float cos2 = 1.0 / (1.0 + dot(tangent, tangent));
    vec4 L = texelFetch(radiance, ivec2(gl_FragCoord.xy), 0);
    irradiance = L * irradiance_per_radiance * cos2 * cos2;
}
