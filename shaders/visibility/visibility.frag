// Which triangle each sample of a tile sees. Everything else is worked out from that for the few
// different surfaces of a cell of samples.
#include "block/tile"
#include "block/spacecraft"
#include "gbuffer/triangles.glsl"
#ifdef CUT_OUT
#include "surface/cut_out.glsl"
#endif

// The triangle's index plus 1; its spacecraft, smooth surface and side. Both are 0 where empty.
out uvec2 seen;

// Over a cell, some 2.2 samples across, normals that turn by less are as good as their mean: the mean
// cosine is right to 5e-5, and a highlight is widened by no more than that.
const float LARGEST_TURN = 0.035;   // [rad]

void main() {
    uint triangle = uint(gl_PrimitiveID);
    float sample_edge = length(sample_steps[0].xyz) / gl_FragCoord.w;   // [m]
    float curvature;
    uint surface = surface_of(triangle, curvature);
    if (2.2 * sample_edge * curvature > LARGEST_TURN) {
        // A surface of its own, different from those of all samples around.
        uvec2 texel = uvec2(gl_FragCoord.xy) & 31u;
        surface = 0x100000u | (texel.y << 5u) | texel.x;
    }
    uint side = gl_FrontFacing ? 0u : 1u;
    seen = uvec2(triangle + 1u, (instance << 22u) | (surface << 1u) | side);
#ifdef CUT_OUT
    cut_out();
#endif
}
