// What each sample of a tile sees of a spacecraft. Its light is worked out from that afterwards, so
// once for each sample: not for surfaces that others hide, nor for the rest of the blocks that a CPU
// renderer draws around each small triangle.
#include "block/spacecraft"
#ifdef DETAILED
#include "gbuffer/detail.glsl"
#endif

in vec3 normal;
in vec3 body_position;
flat in uint label;     // material, and from bit 6 on the rigid group
#ifdef INTERREFLECTION
in vec4 bounced;        // irradiance from the spacecraft's other surfaces [W m-2]
in float earth_share;   // what they leave of the Earth's irradiance
#ifdef TWO_SIDED
in vec4 bounced_back;   // the same behind the surface
in float earth_share_back;
#endif
#endif

// Body axes [m]; label plus 16384 times the spacecraft's number.
layout(location = 0) out vec4 position;
// Normal, camera axes, unit; its spread in the sample's cell.
layout(location = 1) out vec4 normal_roughness;
// Normal of the triangle, camera axes, unit; fraction of the Earth's light that reaches the sample.
layout(location = 2) out vec4 face_normal;
// Irradiance from other surfaces [W m-2].
layout(location = 3) out vec4 indirect;
#ifdef DETAILED
layout(location = 4) out vec4 textured_reflectance;
layout(location = 5) out vec4 textured_emission;   // share of the material's in R, G, B; metallic
layout(location = 6) out vec4 textured_normal;     // with the images' relief; alpha^2
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
    position = vec4(body_position, float(16384u * instance + label));
    vec3 dx = mat3(camera_from_body) * dFdx(body_position);
    vec3 dy = mat3(camera_from_body) * dFdy(body_position);
    // Both sides of an open sheet are surface: its normal turns to the viewer.
    vec3 n = normalize(gl_FrontFacing ? normal : -normal);
    vec3 relief = n;
#ifdef DETAILED
    Textured textured = textured_at(label & 63u, n, dx, dy);
    relief = textured.n;
    textured_reflectance = textured.reflectance;
    textured_emission = vec4(textured.emission, textured.metallic);
    textured_normal = vec4(textured.n, textured.roughness2);
#endif
    normal_roughness = vec4(n, cell_roughness(relief));
    // Steps below 1e-10 m underflow.
    vec3 across = cross(dx, dy);
    face_normal = vec4(dot(across, across) > 0.0 ? normalize(across) : n, 1.0);
    indirect = vec4(0.0);
#ifdef TWO_SIDED
    face_normal.w = gl_FrontFacing ? earth_share : earth_share_back;
    indirect = gl_FrontFacing ? bounced : bounced_back;
#elif defined(INTERREFLECTION)
    face_normal.w = earth_share;
    indirect = bounced;
#endif
#ifdef CUT_OUT
    if (!textured.covered) discard;
#endif
}
