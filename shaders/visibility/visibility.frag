// Which triangle each sample of a tile sees. Everything else is worked out from that for the few
// different surfaces of a cell of samples.
#include "block/spacecraft"
#include "gbuffer/triangles.glsl"
#ifdef CUT_OUT
#include "surface/cut_out.glsl"
#endif

// The triangle's index plus 1; its spacecraft, smooth surface and side. Both are 0 where empty.
out uvec2 seen;

void main() {
    uint triangle = uint(gl_PrimitiveID);
    uint side = gl_FrontFacing ? 0u : 1u;
    seen = uvec2(triangle + 1u, (instance << 22u) | (corners_of(triangle).w << 1u) | side);
#ifdef CUT_OUT
    cut_out();
#endif
}
