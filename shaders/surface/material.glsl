#include "block/materials"
#include "surface/brdf.glsl"

// A point of a spacecraft's surface as light meets it; camera axes.
struct Surface {
    vec3 place;          // [m]
    vec3 wo;             // unit, towards the viewer
    vec3 facet;          // unit normal of the triangle, on the viewer's side
    vec3 n;              // unit normal to shade with
    vec4 reflectance;    // base colour per band
    float metallic;
    float alpha;         // width of the microfacet lobe
    bool lambertian;
};

// Roughness of the normals within one sample's cell, alpha^2 of a microfacet lobe. A uniform cell
// spreads the normal by (|dn/du|^2 + |dn/dv|^2) / 12 per slope, and alpha^2 is twice a slope's
// variance; a lobe so widened is the mean over the cell (after Tokuyoshi & Kaplanyan 2019, whose cap
// of 0.18 keeps silhouettes, where the expansion fails, from going dull).
float cell_roughness(vec3 n) {
    vec3 du = dFdx(n), dv = dFdy(n);
    return min((dot(du, du) + dot(dv, dv)) / 6.0, 0.18);
}

// The surface seen by this sample. Call it outside any branch: it takes derivatives.
//
// place, normal : interpolated, camera axes; material : row of the Materials block
Surface surface_at(vec3 place, vec3 normal, uint material) {
    Surface s;
    s.place = place;
    s.wo = normalize(-place);
    vec3 facet = normalize(cross(dFdx(place), dFdy(place)));
    s.facet = dot(facet, s.wo) < 0.0 ? -facet : facet;
    // Both sides of an open sheet are surface: its normal turns to the viewer.
    s.n = normalize(gl_FrontFacing ? normal : -normal);
    vec4 law = material_law[material];   // metallic, roughness, 1 if Lambertian
    s.reflectance = material_reflectance[material];
    s.metallic = law.x;
    s.alpha = sqrt(pow(law.y, 4.0) + cell_roughness(s.n));
    s.lambertian = law.z > 0.5;
    return s;
}

// Bidirectional reflectance [sr-1] per band, its mean over a small uniform disc of light.
//
// wi : unit, towards the disc's centre; radius : angular, of the disc [rad]
vec4 reflection(Surface s, vec3 wi, float radius) {
    if (s.lambertian) return s.reflectance / PI;
    return brdf(s.reflectance, s.metallic, s.alpha, s.n, wi, s.wo, radius);
}
