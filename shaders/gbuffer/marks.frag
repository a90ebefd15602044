// Marks the shading points that see a spacecraft, by their depth: nothing else is drawn of the others.
// With LAYERED, points of layered materials lie on the other side of theirs.
#define GROUPED
#include "block/spacecraft"
#include "gbuffer/cells.glsl"
#ifdef LAYERED
#include "gbuffer/triangles.glsl"
#include "surface/layers.glsl"

// As in gbuffer/gbuffer.frag.
uniform sampler2D mesh_vertices;
#ifdef DETAILED
const uint VERTEX_TEXELS = 4u;
#else
const uint VERTEX_TEXELS = 2u;
#endif
#endif

uniform usampler2D visibility;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy), cell = cell_of_point(at);
    uint group = group_of(at);
    uint left = max(group, 1u);
    uvec2 seen = texelFetch(visibility, max(first_texel(cell) + next_texel(left), 0), 0).rg;
    if (group == 0u || seen.y >> 22u != instance) discard;
#ifdef LAYERED
    uint corner = corners_of(max(seen.x, 1u) - 1u).z;
    float label = texelFetch(mesh_vertices, table_place(VERTEX_TEXELS * corner), 0).w;
    gl_FragDepth = is_layered(material_of(label)) ? 1.0 - gl_FragCoord.z : gl_FragCoord.z;
#endif
}
