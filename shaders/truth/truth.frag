// Depth along the boresight [m], and which part of which spacecraft: instance * 65536 + part + 1.
#include "block/spacecraft"
#ifdef CUT_OUT
#include "surface/cut_out.glsl"
#endif

in float depth;
flat in uint part;

layout(location = 0) out float out_depth;
layout(location = 1) out uint out_part;
#ifdef NORMALS
in vec3 position;
in vec3 normal;

layout(location = 2) out vec4 out_normal;

// Of the side that is seen: sheets have one for both.
vec3 seen_normal() {
    vec3 facet = cross(dFdx(position), dFdy(position));
    float away = dot(facet, position) * dot(facet, normal);
    return normalize(away > 0.0 ? -normal : normal);
}
#endif

void main() {
    out_depth = depth;
    out_part = instance * 65536u + part + 1u;
#ifdef NORMALS
    out_normal = vec4(seen_normal(), 0.0);
#endif
#ifdef CUT_OUT
    cut_out();
#endif
}
