// The air between a camera and a spacecraft: light scattered towards the camera, and transmittance.
#include "air/march.glsl"
#include "block/airsegment"

layout(location = 0) out vec4 light;
layout(location = 1) out vec4 transmittance;

void main() {
    Passage air = march(Stretch(segment_place.x, segment_place.y, segment_sun.x, segment_sun.y,
                                segment_place.z, segment_place.w), STEPS);
    light = air.light;
    transmittance = air.transmittance;
}
