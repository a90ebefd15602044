// Share of the sunlight that reaches what each sample of a spacecraft sees, per band. Drawn twice:
// first what needs no search through the Sun's disc; then, with SEARCH, the rest, which the first
// draw has left out.
#include "block/spacecraft"
#include "block/shadow"
#include "surface/shadow.glsl"

// The whole map, and right of it the close one where there is one.
uniform sampler2D sun_depths;
uniform sampler2D sun_tops;
#ifdef SEARCH
uniform sampler2D sun_behind;
#endif

// What the samples see: targets of gbuffer/gbuffer.frag.
uniform sampler2D gbuffer_position;
uniform sampler2D gbuffer_normal_roughness;
uniform sampler2D gbuffer_face_normal;

out vec4 lit_fraction;

// Numbers 0..1 that spread evenly over any neighbourhood of samples, after the plastic number's
// relatives (M. Roberts 2018).
vec2 evenly_spread(vec2 sample_index) {
    return fract(0.5 + vec2(dot(sample_index, vec2(0.7548776662, 0.5698402910)),
                            dot(sample_index, vec2(0.8566748838, 0.7338918566))));
}

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec3 wi = sun_direction.xyz;
    vec3 body = texelFetch(gbuffer_position, at, 0).xyz;
    vec3 n = texelFetch(gbuffer_normal_roughness, at, 0).xyz;
    vec3 facet = texelFetch(gbuffer_face_normal, at, 0).xyz;
    if (dot(facet, (camera_from_body * vec4(body, 1.0)).xyz) > 0.0) facet = -facet;
    // Both maps: edge of a texel, top, depth, inset; size, column, column of the bounds.
    vec4 frame = shadow_frame[0], atlas = shadow_atlas[0];
    vec3 here = (shadow_from_body[0] * vec4(body, 1.0)).xyz;
    vec3 closer = (shadow_from_body[1] * vec4(body, 1.0)).xyz;
    vec2 inside = min(closer.xy, shadow_atlas[1].x - closer.xy);
    if (min(inside.x, inside.y) > shadow_frame[1].w) {
        frame = shadow_frame[1];
        atlas = shadow_atlas[1];
        here = closer;
    }
    // The smooth surface that the normals stand for lies above its facets by the sagitta of an edge;
    // a quarter of a texel lifts the receiver there. Facets that already face away use its plane.
    vec3 plain_n = mat3(light_from_camera) * n;
    vec3 plane = dot(facet, wi) > 0.0 ? mat3(light_from_camera) * facet : plain_n;
    here += plain_n * vec3(0.25, 0.25, 0.25 * frame.x);
    SunMap map = SunMap(frame.x, frame.y, frame.z, int(atlas.x), int(atlas.y), int(atlas.z),
                        shadow_lean / frame.x, shadow_solid > 0.5, int(shadow_taps));
    Receiver receiver = receiver_at(map, here, plane);
    Around around = casters_around(sun_tops, map, receiver, atlas.w);
    // Where the surface faces away no light is asked for.
    bool away = dot(n, wi) <= 0.0;
#ifdef SEARCH
    vec2 turn = evenly_spread(floor(gl_FragCoord.xy));
    lit_fraction = disc_past(sun_depths, sun_behind, map, receiver, around, atlas.w, sun_limb_u,
                             sun_limb_v, turn);
#else
    lit_fraction = vec4(1.0);
    if (around.dark || away) lit_fraction = vec4(0.0);
    else WHEN(around.near)
        lit_fraction = vec4(lit_by_neighbours(sun_depths, map, receiver, around.high));
    if (around.search && !away) discard;
#endif
}
