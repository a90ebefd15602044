// Which triangle each sample of a tile sees. Everything else is worked out from that for the few
// different surfaces of a cell of samples.
#include "block/tile"
#include "block/spacecraft"
#include "gbuffer/triangles.glsl"
#ifdef CUT_OUT
#include "surface/cut_out.glsl"
#endif

// The triangle's index plus 1; its spacecraft, smooth surface and side. Both are 0 where empty. Two targets:
// llvmpipe clears one of 8 bytes a sample word by word, in five times the time of two of 4 bytes.
layout(location = 0) out uint seen_triangle;
layout(location = 1) out uint seen_surface;

void main() {
    uint triangle;
    float curvature;
    uint surface = surface_of(uint(gl_PrimitiveID), triangle, curvature);
    if (curvature > largest_curvature * gl_FragCoord.w) {
        // A surface of its own, different from those of all samples around.
        uvec2 texel = uvec2(gl_FragCoord.xy) & 31u;
        surface = 0x100000u | (texel.y << 5u) | texel.x;
    }
    uint side = gl_FrontFacing ? 0u : 1u;
    seen_triangle = triangle + 1u;
    seen_surface = (instance << 22u) | (surface << 1u) | side;
#ifdef CUT_OUT
    cut_out();
#endif
}
