// What each sample of a tile sees of a spacecraft. Its light is worked out from that afterwards, so
// once for each sample: not for surfaces that others hide, nor for the rest of the blocks that a CPU
// renderer draws around each small triangle.
#include "block/craft"
#ifdef DETAILED
#include "gbuffer/detail.glsl"
#endif

in vec3 normal;
in vec3 body_position;
flat in uint label;     // material, and from bit 6 on the rigid group
#ifdef EXCHANGE
in vec4 bounced;        // irradiance from the craft's other surfaces [W m-2]
in float earth_share;   // what they leave of the Earth's irradiance
#ifdef TWO_SIDED
in vec4 bounced_back;   // the same behind the surface
in float earth_share_back;
#endif
#endif

layout(location = 0) out vec4 place;    // body axes [m]; label plus 16384 times the craft's number
layout(location = 1) out vec4 shape;    // normal, camera axes, unit; its spread in the sample's cell
layout(location = 2) out vec4 plane;    // normal of the triangle; share of the Earth's light
layout(location = 3) out vec4 others;   // irradiance from other surfaces [W m-2]
#ifdef DETAILED
layout(location = 4) out vec4 worn_reflectance;
layout(location = 5) out vec4 worn_emission;   // share of the material's in R, G, B; metallic
layout(location = 6) out vec4 worn_normal;     // with the images' relief; alpha^2
#endif

// Roughness of the normals within one sample's cell, alpha^2 of a microfacet lobe. A uniform cell
// spreads the normal by (|dn/du|^2 + |dn/dv|^2) / 12 per slope, and alpha^2 is twice a slope's
// variance; a lobe so widened is the mean over the cell (after Tokuyoshi & Kaplanyan 2019, whose cap
// of 0.18 keeps silhouettes, where the expansion fails, from going dull).
float cell_roughness(vec3 n) {
    vec3 du = dFdx(n), dv = dFdy(n);
    return min((dot(du, du) + dot(dv, dv)) / 6.0, 0.18);
}

void main() {
    place = vec4(body_position, float(16384u * instance + label));
    vec3 dx = mat3(camera_from_body) * dFdx(body_position);
    vec3 dy = mat3(camera_from_body) * dFdy(body_position);
    // Both sides of an open sheet are surface: its normal turns to the viewer.
    vec3 n = normalize(gl_FrontFacing ? normal : -normal);
    vec3 relief = n;
#ifdef DETAILED
    Worn worn = worn_at(label & 63u, n, dx, dy);
    relief = worn.n;
    worn_reflectance = worn.reflectance;
    worn_emission = vec4(worn.emission, worn.metallic);
    worn_normal = vec4(worn.n, worn.roughness2);
#endif
    shape = vec4(n, cell_roughness(relief));
    plane = vec4(normalize(cross(dx, dy)), 1.0);
    others = vec4(0.0);
#ifdef TWO_SIDED
    plane.w = gl_FrontFacing ? earth_share : earth_share_back;
    others = gl_FrontFacing ? bounced : bounced_back;
#elif defined(EXCHANGE)
    plane.w = earth_share;
    others = bounced;
#endif
#ifdef CUT_OUT
    if (!worn.there) discard;
#endif
}
