// Depth along the boresight [m], and which part of which spacecraft: instance * 65536 + part + 1.
#include "block/craft"
#ifdef CUT_OUT
#include "surface/cut_out.glsl"
#endif

in float depth;
flat in uint part;

layout(location = 0) out float out_depth;
layout(location = 1) out uint out_part;

void main() {
    out_depth = depth;
    out_part = instance * 65536u + part + 1u;
#ifdef CUT_OUT
    cut_out();
#endif
}
