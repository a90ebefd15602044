// Marks the shading points that see a spacecraft, by their depth: nothing else is drawn of the others.
// With LAYERED, points of layered materials lie on the other side of theirs.
#define GROUPED
#include "block/spacecraft"
#include "gbuffer/cells.glsl"
#ifdef LAYERED
#include "gbuffer/triangles.glsl"
#include "surface/layers.glsl"
#endif

uniform usampler2D seen_surfaces;
#ifdef LAYERED
uniform usampler2D seen_triangles;
#endif

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy), cell = cell_of_point(at);
    uint group = group_of(at);
    uint left = max(group, 1u);
    ivec2 texel = max(first_texel(cell) + next_texel(left), 0);
    if (group == 0u || read_texel(seen_surfaces, texel).r >> 22u != instance) discard;
#ifdef LAYERED
    uint material = material_of_triangle(max(read_texel(seen_triangles, texel).r, 1u) - 1u);
    gl_FragDepth = is_layered(material) ? 1.0 - gl_FragCoord.z : gl_FragCoord.z;
#endif
}
