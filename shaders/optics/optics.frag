// Irradiance of the image plane from the radiance that each pixel sees, W m-2 per band.
//
// A lens gives E = pi L T cos^4(theta) / (4 N^2), all of it but the cosine folded per band into
// irradiance_per_radiance [sr]. A map of what is left off the axis may stand for the cosine.
#include "block/optics"

uniform sampler2D radiance;
#ifdef MAPPED
uniform sampler2D relative_illumination;
#endif

out vec4 irradiance;

float off_axis() {
#ifdef MAPPED
    return texelFetch(relative_illumination, ivec2(gl_FragCoord.xy), 0).r;
#else
    vec2 tangent = (gl_FragCoord.xy - intrinsics.zw) / intrinsics.xy;
    float cos2 = 1.0 / (1.0 + dot(tangent, tangent));
    return cos2 * cos2;
#endif
}

void main() {
    vec4 L = texelFetch(radiance, ivec2(gl_FragCoord.xy), 0);
    irradiance = L * irradiance_per_radiance * off_axis();
}
