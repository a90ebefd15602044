#ifdef CUT_OUT
#include "surface/cut_out.glsl"
#endif

// 1 / z [m-1] of the nearest caster, z its distance along the beam. It is what the rasteriser
// interpolates anyway: exact and linear over the map for every plane. One of both channels is written.
out vec2 nearness;

void main() {
    nearness = vec2(gl_FragCoord.w);
#ifdef CUT_OUT
    cut_out();
#endif
}
