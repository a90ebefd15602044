// What images cut away is left out. For programs that draw no surface but its outline.
#include "surface/textures.glsl"

in vec2 uv;     // place in the images
in vec4 tint;   // factors of the base colour and of coverage
flat in uint material;

void cut_out() {
    Cell cell = Cell(uv, dFdx(uv), dFdy(uv));
    if (!is_covered(material, base_colour_at(material, cell, tint).a)) discard;
}
