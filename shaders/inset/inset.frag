// A picture in sRGB code with opacity, in a part of a window.
//
// The picture keeps row 0 at its top, the window at its bottom.
#include "block/inset"

uniform sampler2D inset;

out vec4 shown;

void main() {
    vec2 place = (gl_FragCoord.xy - place_in_window.xy) / place_in_window.zw;
    shown = texture(inset, vec2(place.x, 1.0 - place.y));
}
