#ifdef CUT_OUT
#include "surface/cut_out.glsl"
#endif

// 1 / z [m-1] of the nearest caster, z its distance along the beam. It is what the rasteriser
// interpolates anyway: exact and linear over the map for every plane. One of red and green is written,
// with red its change from one column and one row to the next.
out vec4 nearness;

void main() {
    nearness = vec4(vec2(gl_FragCoord.w), dFdx(gl_FragCoord.w), dFdy(gl_FragCoord.w));
#ifdef CUT_OUT
    cut_out();
#endif
}
