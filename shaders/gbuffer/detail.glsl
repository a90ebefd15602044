// What images and vertex colours make of a surface.
#include "surface/textures.glsl"

uniform sampler2DArray law_images;        // roughness, metallic
uniform sampler2DArray normal_images;     // along the rows, up the columns, out of the surface
uniform sampler2DArray emission_images;   // red, green, blue share

struct Textured {
    vec4 reflectance;
    vec3 emission;      // share of the material's, red, green, blue
    float metallic;
    float roughness2;   // alpha^2
    vec3 n;             // unit normal with the relief, camera axes
};

// Tilts the normal as an image says. Returns alpha^2 of the relief that the cell holds.
//
// m : mean of the image's unit vectors over the cell; scale : of their slopes
// texels : width of the cell; dx, dy : steps of the place, camera axes [m]
// back : the normal is that of the triangle's back
float tilt(inout Textured s, vec3 m, float scale, float texels, Cell cell, vec3 dx, vec3 dy,
           bool back) {
    // Towards growing u, and towards the image's top; both from the steps, so that mirrored images
    // are right without tangents in the mesh.
    float side = sign(cell.dx.x * cell.dy.y - cell.dx.y * cell.dy.x);
    vec3 along = side * (dx * cell.dy.y - dy * cell.dx.y);
    vec3 up = side * (dx * cell.dy.x - dy * cell.dx.x);
    vec3 n = back ? -s.n : s.n;
    along -= n * dot(n, along);
    float stretch = length(along);
    if (stretch <= 0.0) return 0.0;
    vec3 t = along / stretch;
    vec3 b = cross(n, t);
    if (dot(b, up) < 0.0) b = -b;
    vec3 tilted = normalize(scale * (m.x * t + m.y * b) + max(m.z, 1e-3) * n);
    s.n = back ? -tilted : tilted;
    // Unit vectors that spread by a slope's variance v to both sides have a mean of length 1 - v
    // (after Toksvig 2005); alpha^2 is twice that variance. Half floats shorten a vector by up to
    // 3e-4; and a cell narrower than a texel holds no relief, only the way from one to the next.
    float shortened = length(m) + 3e-4;
    float variance = max(1.0 - shortened, 0.0) / shortened;
    return 2.0 * scale * scale * variance * clamp(log2(texels), 0.0, 1.0);
}

// What the images and the vertex colours say of a sample; the near infrared follows red.
//
// n : unit normal, camera axes; dx, dy : steps of the place, camera axes [m]
// tint : of the vertices; back : the normal is that of the triangle's back
Textured textured_at(uint material, vec3 n, Cell cell, vec4 tint, vec3 dx, vec3 dy, bool back) {
    vec4 stated = material_law[material];   // metallic, roughness
    Textured s = Textured(material_reflectance[material], vec3(1.0), stated.x,
                          pow(stated.y, 4.0), n);
    ivec4 images = ivec4(material_images[material]);
    s.reflectance *= base_colour_at(material, cell, tint).rgbr;
    if (images.y >= 0) {
        vec2 law = image_at(law_images, images.y, cell).xy;
        s.roughness2 = max(s.roughness2 * pow(law.x, 4.0), 1e-8);   // the smoothest that is drawn
        s.metallic *= law.y;
    }
    if (images.z >= 0) {
        vec2 size = vec2(textureSize(normal_images, 0).xy);
        float texels = max(length(cell.dx * size), length(cell.dy * size));
        vec3 m = image_at(normal_images, images.z, cell).xyz;
        s.roughness2 += tilt(s, m, material_image_use[material].x, texels, cell, dx, dy, back);
    }
    if (images.w >= 0) s.emission *= image_at(emission_images, images.w, cell).rgb;
    return s;
}
