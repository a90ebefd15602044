// A share of a picture.
#include "block/average"

uniform sampler2D picture;

out vec4 radiance;

void main() {
    radiance = share * texelFetch(picture, ivec2(gl_FragCoord.xy), 0);
}
