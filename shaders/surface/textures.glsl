// Images on a surface, and where it is cut away. For programs that define DETAILED.
#include "block/materials"

uniform sampler2DArray base_colour_images;   // red, green, blue reflectance, coverage

// The cell of a sample in the images, v down from the top row.
struct Cell {
    vec2 uv;
    vec2 dx, dy;   // steps to the neighbouring samples
};

// Value of an image, its mean over the cell.
//
// worn : 16 times the layer, plus how the image goes on past its edges: along u, plus 4 times along
// v, 0 repeated, 1 as its edge, 2 mirrored
vec4 image_at(sampler2DArray images, int worn, Cell cell) {
    ivec2 wrap = ivec2(worn & 3, (worn >> 2) & 3);
    // The array repeats. Within half a texel of an edge, the other edge would shine through.
    vec2 texel = max(1.0 / vec2(textureSize(images, 0).xy), max(abs(cell.dx), abs(cell.dy)));
    vec2 margin = min(0.5 * texel, 0.5);
    vec2 wrapped = mix(cell.uv, 1.0 - abs(mod(cell.uv, 2.0) - 1.0), equal(wrap, ivec2(2)));
    wrapped = mix(clamp(wrapped, margin, 1.0 - margin), cell.uv, equal(wrap, ivec2(0)));
    return textureGrad(images, vec3(wrapped, float(worn >> 4)), cell.dx, cell.dy);
}

// Factors of the base colour and of the coverage.
//
// tint : of red, green, blue reflectance and of coverage, as the vertices have it
vec4 base_colour_at(uint material, Cell cell, vec4 tint) {
    int worn = int(material_images[material].x);
    return worn < 0 ? tint : tint * image_at(base_colour_images, worn, cell);
}

// Whether a surface of the coverage that the images and the vertex colours give is there at all.
bool is_covered(uint material, float coverage) {
    vec4 use = material_image_use[material];   // scale of the normal map, coverage, cutoff
    return use.y * coverage >= use.z;
}
