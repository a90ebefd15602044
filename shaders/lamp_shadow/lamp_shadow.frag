#ifdef CUT_OUT
#include "surface/cut_out.glsl"
#endif

// 1 / z [m-1] of the nearest caster, z its distance along the beam. It is what the rasteriser
// interpolates anyway: exact and linear over the map for every plane. One of both channels is written.
layout(location = 0) out vec2 nearness;
// Its change from one column and one row to the next.
layout(location = 1) out vec2 slopes;

void main() {
    nearness = vec2(gl_FragCoord.w);
    slopes = vec2(dFdx(gl_FragCoord.w), dFdy(gl_FragCoord.w));
#ifdef CUT_OUT
    cut_out();
#endif
}
