// One triangle over the whole viewport.
#include "common/corner.glsl"

void main() {
    gl_Position = corner_of_screen();
}
