// The tiles that aurora.frag finds pixel by pixel.
#include "block/planet"

in vec2 corner;

void main() {
    gl_Position = vec4(corner * area.zw - 1.0, 0.0, 1.0);
}
