// Irradiance of the image plane [W m-2 per band] from the radiance that each pixel sees, and weighted sums of
// its bands, each in a target of its own, of four neighbouring pixels of a row at a time.
//
// PLANES is how many sums there are, 1 to 4.
#include "block/spread"
#include "optics/off_axis.glsl"

uniform sampler2D radiance;

layout(location = 0) out vec4 first;
#if PLANES > 1
layout(location = 1) out vec4 second;
#endif
#if PLANES > 2
layout(location = 2) out vec4 third;
#endif
#if PLANES > 3
layout(location = 3) out vec4 fourth;
#endif

// Irradiance behind a pixel; the last group may reach past the end of the row.
vec4 irradiance(ivec2 pixel) {
    pixel.x = min(pixel.x, textureSize(radiance, 0).x - 1);
    return texelFetch(radiance, pixel, 0) * irradiance_per_radiance * off_axis(pixel, intrinsics);
}

void main() {
    ivec2 left = ivec2(4 * int(gl_FragCoord.x), int(gl_FragCoord.y));
    mat4 pixels = mat4(irradiance(left), irradiance(left + ivec2(1, 0)), irradiance(left + ivec2(2, 0)),
                       irradiance(left + ivec2(3, 0)));
    mat4 sums = transpose(mixture * pixels);
    first = sums[0];
#if PLANES > 1
    second = sums[1];
#endif
#if PLANES > 2
    third = sums[2];
#endif
#if PLANES > 3
    fourth = sums[3];
#endif
}
