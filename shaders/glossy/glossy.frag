// What rays need to know of the glossy points: drawn one beside the other, body axes.
#include "block/spacecraft"
#include "gbuffer/page_places.glsl"
#include "glossy/lobes.glsl"

// Columns of the points, and from bit 16 on rows; behind the last all bits are set.
uniform usampler2D listed_points;

layout(location = 0) out vec4 place;    // [m]; width of the base's lobe, 0 for none
layout(location = 1) out vec4 normal;   // to shade with; width of the coat's lobe, 0 for none
layout(location = 2) out vec4 facet;    // of the triangle, towards the viewer; mean F0 of the base
layout(location = 3) out vec4 viewer;   // unit, towards the viewer; number of the material

void main() {
    uint point = texelFetch(listed_points, ivec2(gl_FragCoord.xy), 0).r;
    if (point == ~0u) discard;
    ivec2 at = ivec2(point & 65535u, point >> 16u);
    Surface s = gbuffer_surface(at);
    uint material = material_of(texelFetch(gbuffer_position, at, 0).w);
    vec2 widths = lobe_widths(s, material, texelFetch(gbuffer_normal_roughness, at, 0).w);
    mat3 body_from_camera = transpose(mat3(camera_from_body));
#ifdef MOVING
    body_from_camera = transpose(mat3(pose_at(seen_time(s.body, vec3(0.0)))));
#endif
    vec4 f0 = normal_reflectance(s);
    place = vec4(s.body, widths.x);
    normal = vec4(body_from_camera * s.n, widths.y);
    facet = vec4(body_from_camera * s.facet, 0.25 * (f0.r + f0.g + f0.b + f0.a));
    viewer = vec4(body_from_camera * s.wo, float(material));
}
