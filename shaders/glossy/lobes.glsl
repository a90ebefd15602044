#include "surface/followed.glsl"
#include "surface/gbuffer.glsl"

// Wider lobes see so much of the spacecraft that the mean of its light does.
const float WIDEST = 0.5;

// Width of a lobe that a crumpled foil's facets widen; 0 where it is not followed.
float lobe_width(float alpha, vec4 layers, float followed) {
    if (layers.z > 0.0) alpha = sqrt(widened(alpha * alpha, 2.0 * layers.w * layers.w));
    return alpha <= WIDEST && followed > 0.0 ? alpha : 0.0;
}

// The widths of the base's lobe and of the coat's; 0 where there is none, or none that is followed.
//
// spread : of the normals within the point's part of its cell
vec2 lobe_widths(Surface s, uint material, float spread) {
    vec4 layers = material_layers[material];   // of the coat: strength, roughness; of the crinkle
    s.coat = layers.x;
    float coat_alpha = sqrt(pow(layers.y, 4.0) + spread);
    return vec2(lobe_width(s.alpha, layers, base_followed(s)),
                lobe_width(coat_alpha, layers, coat_followed(s)));
}
