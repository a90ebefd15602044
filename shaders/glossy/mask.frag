// Which points of each page have lobes that may see their own spacecraft: a bit for each.
#include "block/spacecraft"
#define GROUPED
#include "gbuffer/cells.glsl"
#include "glossy/lobes.glsl"

uniform usampler2D seen_surfaces;

out uint mask;

// Whether a point is there, and one of this spacecraft.
bool is_present(ivec2 at) {
    ivec2 cell = cell_of_point(at);
    uint group = group_of(at);
    if (group == 0u) return false;
    return texelFetch(seen_surfaces, first_texel(cell) + next_texel(group), 0).r >> 22u == instance;
}

// Whether another surface can be seen from a point: one sends light there, or takes the Earth's.
bool sees_others(ivec2 at, Surface s) {
#ifdef INTERREFLECTION
    return s.earth_share < 1.0 || any(greaterThan(s.indirect, vec4(0.0)));
#else
    return true;
#endif
}

void main() {
    ivec2 entry = ivec2(gl_FragCoord.xy);
    ivec2 first = texel_of_page(entry.y * 4 * SQUARES + entry.x);
    mask = 0u;
    for (int k = 0; k < 4; ++k) {
        ivec2 at = first + ivec2(k & 1, k >> 1);
        bool listed = false;
        if (is_present(at)) {
            Surface s = gbuffer_surface(at);
            uint material = material_of(texelFetch(gbuffer_position, at, 0).w);
            float spread = texelFetch(gbuffer_normal_roughness, at, 0).w;
            listed = lobe_widths(s, material, spread) != vec2(0.0) && sees_others(at, s);
        }
        mask |= listed ? 1u << uint(k) : 0u;
    }
}
