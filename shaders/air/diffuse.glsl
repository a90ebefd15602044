// Light that was scattered or reflected at least once, by height and the Sun's angle.
//
// Its radiance field L(w), w the direction it comes from, is kept as moments in axes x (the Sun's
// horizontal direction) and z (up): mean J = int L dw, flow F = int L w dw, tensor M = int L w w^T dw.
// Rayleigh scattering reads nothing else of a field; the peak of the aerosol's phase function is cut
// after its second Legendre term, for this light only.
#include "air/medium.glsl"
#include "air/diffuse_place.glsl"

uniform sampler2D diffuse_j;
uniform sampler2D diffuse_fx;
uniform sampler2D diffuse_fz;
uniform sampler2D diffuse_mxx;
uniform sampler2D diffuse_mzz;
uniform sampler2D diffuse_mxz;

// Radiance that a kilometre of the medium turns from this light into the way against a view
// direction at `mu` from the zenith and `nu` from the Sun [sr-1 km-1].
vec4 diffuse_source(Medium medium, float height, float mu, float mu_sun, float nu) {
    vec2 place = diffuse_place(height, mu_sun, vec2(textureSize(diffuse_j, 0)));
    vec4 j = textureLod(diffuse_j, place, 0.0);
    vec4 fx = textureLod(diffuse_fx, place, 0.0), fz = textureLod(diffuse_fz, place, 0.0);
    vec4 mxx = textureLod(diffuse_mxx, place, 0.0), mzz = textureLod(diffuse_mzz, place, 0.0);
    vec4 mxz = textureLod(diffuse_mxz, place, 0.0);
    float x = (nu - mu * mu_sun) / sqrt(max(1.0 - mu_sun * mu_sun, 1e-6));
    float y2 = max(1.0 - x * x - mu * mu, 0.0);
    vec4 q = x * x * mxx + y2 * (j - mxx - mzz) + mu * mu * mzz + 2.0 * x * mu * mxz;
    vec4 g = aerosol_asymmetry;
    vec4 by_aerosol = j + 3.0 * g * (x * fx + mu * fz) + 5.0 * g * g * (1.5 * q - 0.5 * j);
    return medium.rayleigh * (3.0 / (16.0 * PI)) * (j + q) + medium.aerosol / (4.0 * PI) * by_aerosol;
}
