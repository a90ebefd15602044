// Irradiance of the image plane from the radiance that each pixel sees, W m-2 per band.
//
// A lens gives E = pi L T cos^4(theta) / (4 N^2), all of it but the cosine folded per band into
// irradiance_per_radiance [sr]. A map of what is left off the axis may stand for the cosine.
#include "block/optics"
#include "common/texels.glsl"
#include "optics/off_axis.glsl"

uniform sampler2D radiance;

out vec4 irradiance;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 L = read_texel(radiance, pixel);
    irradiance = L * irradiance_per_radiance * off_axis(pixel, intrinsics);
}
