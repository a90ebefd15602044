// The Sun's disc, radiance [W m-2 sr-1].
#include "block/planet"
#include "common/coverage.glsl"
#include "common/sun.glsl"

// Radiance of the Sun's disc where the ray passes `off` [rad] from its centre; 0 outside.
vec4 sun_disc(float off) {
    float width = length(vec2(dFdx(off), dFdy(off)));
    float seen = coverage(sun_angular_radius - off);
    // The pixel's part that lies on the disc.
    float near = clamp((off - 0.5 * width) / sun_angular_radius, -1.0, 0.999);
    float far = min((off + 0.5 * width) / sun_angular_radius, 1.0);
    return sun_radiance * limb_mean(near, far, sun_limb_u, sun_limb_v) * seen;
}
