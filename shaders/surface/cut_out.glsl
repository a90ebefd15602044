// What images cut away is left out. For programs that draw no surface but its outline.
#include "surface/textures.glsl"

flat in uint material;

void cut_out() {
    Cell cell = Cell(uv, dFdx(uv), dFdy(uv));
    if (!is_covered(material, base_colour_at(material, cell).a)) discard;
}
