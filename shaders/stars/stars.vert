// Each star as a square of 3 x 3 pixels around the one that holds it.
#include "block/stars"

in vec2 in_pixel;
in vec4 in_irradiance;

flat out vec2 star;
flat out vec4 irradiance;

void main() {
    star = in_pixel;
    irradiance = in_irradiance;
    vec2 corner = floor(in_pixel) - 1.0 + 3.0 * vec2(gl_VertexID & 1, gl_VertexID >> 1);
    gl_Position = vec4(2.0 * corner / image_size - 1.0, 0.0, 1.0);
}
