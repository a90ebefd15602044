// Each star as the rectangle of pixels that its triangle reaches.
#include "block/stars"

in vec2 in_pixel;
in vec2 in_width;
in vec4 in_irradiance;

flat out vec2 star;
flat out vec2 width;
flat out vec4 irradiance;

void main() {
    star = in_pixel;
    width = in_width;
    irradiance = in_irradiance;
    vec2 low = floor(in_pixel - in_width), high = floor(in_pixel + in_width) + 1.0;
    vec2 corner = mix(low, high, vec2(gl_VertexID & 1, gl_VertexID >> 1));
    gl_Position = vec4(2.0 * corner / image_size - 1.0, 0.0, 1.0);
}
