// What cut_out.glsl needs of a vertex.
in vec2 in_uv;         // place in the images
in vec4 in_tint;       // factors of the base colour

out vec2 uv;
out vec4 tint;
flat out uint material;

void hand_on(uint row) {
    uv = in_uv;
    tint = in_tint;
    material = row;
}
