#ifdef CUT_OUT
#include "surface/cut_out.glsl"
#endif
#ifdef SLOPES
// Change of depth from one column and one row to the next, in edges of texels.
out vec2 slopes;
#endif
#if defined(BEHIND) || defined(SLOPES)
#include "block/caster"
#endif
#ifdef BEHIND
#include "common/texels.glsl"

uniform sampler2D before;   // another map; its lower half: where the light leaves the casters

// Leaves what the light would meet after it left those casters.
void skip_before() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    int size = int(caster_map_size);
    float left = read_texel(before, ivec2(at.x, at.y + size)).r;
    // Two steps of 24-bit depth: a surface does not lie behind itself.
    if (gl_FragCoord.z <= left + 1.2e-7) discard;
}
#endif

void main() {
#ifdef SLOPES
    slopes = caster_map_depth * vec2(dFdx(gl_FragCoord.z), dFdy(gl_FragCoord.z));
#endif
#ifdef CUT_OUT
    cut_out();
#endif
#ifdef BEHIND
    skip_before();
#endif
}
