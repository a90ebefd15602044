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
    return material_layers[material].x > 0.0 || material_law[material].w > 0.5
        || is_patterned(material);
}
