// Which materials are more than one reflection law.
#include "block/materials"

uint material_of(float label) {
    return uint(label) & 63u;
}

// Whether a material varies from sample to sample.
bool is_patterned(uint material) {
    return max(material_layers[material].z, material_cells[material].x) > 0.0;
}

// Whether a material is more than one reflection law, the same all over.
bool is_layered(uint material) {
    uint word = material < 32u ? layered_materials.x : layered_materials.y;
    return (word >> (material & 31u) & 1u) == 1u;
}
