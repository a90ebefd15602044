// One triangle over the whole viewport, whose corners hand values of blocks to the fragments
// (simgl/gpu/handed_values.py).
#include "common/corner.glsl"
#include "block/handed_values"

void main() {
    gl_Position = corner_of_screen();
    hand_values();
}
