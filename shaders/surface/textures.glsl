// Images on a surface, and where it is cut away. For programs that define DETAILED.
#include "block/materials"

uniform sampler2DArray base_colour_images;   // red, green, blue reflectance, coverage

// The cell of a sample in the images, v down from the top row.
struct Cell {
    vec2 uv;
    vec2 dx, dy;   // steps to the neighbouring samples
};

// Readings along a cell at most; a longer cell is blurred across, too.
const float READINGS = 8.0;

// The mean of an image over a cell around a place in it.
//
// In as many readings as the cell is longer than wide: one would be as blurred across as along. A GPU's own
// anisotropic filter does that as well, but errs by 0.4 % of the mean.
vec4 mean_over(sampler2DArray images, vec3 place, Cell cell) {
    vec2 size = vec2(textureSize(images, 0).xy);
    vec2 dx = cell.dx * size, dy = cell.dy * size;   // [texels]
    float mean = 0.5 * (dot(dx, dx) + dot(dy, dy));
    float slant = 0.5 * (dx.x * dx.x + dy.x * dy.x - dx.y * dx.y - dy.y * dy.y), both = dx.x * dx.y + dy.x * dy.y;
    float spread = sqrt(slant * slant + both * both);
    float longest = sqrt(mean + spread), shortest = sqrt(max(mean - spread, 1.0));
    if (longest <= 1.5 * shortest) return textureGrad(images, place, cell.dx, cell.dy);
    vec2 along = slant >= 0.0 ? vec2(slant + spread, both) : vec2(both, spread - slant);
    along *= longest / (length(along) * size);
    float count = min(ceil(longest / shortest), READINGS), level = log2(max(longest / count, shortest));
    vec4 sum = vec4(0.0);
    for (float i = 0.5; i < count; i++)
        sum += textureLod(images, vec3(place.xy + (i / count - 0.5) * along, place.z), level);
    return sum / count;
}

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
    return mean_over(images, vec3(wrapped, float(worn >> 4)), cell);
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
