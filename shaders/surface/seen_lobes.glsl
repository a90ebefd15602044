#include "gbuffer/page_places.glsl"
#include "surface/followed.glsl"

// Of the listed points (simgl/passes/glossy.py) three texels each: mean radiance of the spacecraft that
// the base's lobe sees [W m-2 sr-1], that of the coat's; shares of the two that go past it, negative
// where a lobe was not followed.
uniform sampler2D seen_lobes;
// Of each page: from bit 4 on how many listed points come before its own, below it which are listed.
uniform usampler2D seen_pages;

const int SEEN_COLUMNS = 1023;   // of simgl/passes/glossy.py: a point's texels in one row

// A surface with what rays from the point have seen.
Surface with_seen_lobes(Surface s, ivec2 at) {
    uint page = texelFetch(seen_pages, entry_of_point(at), 0).r;
    bool listed = (page >> uint(2 * (at.y & 1) + (at.x & 1)) & 1u) == 1u;
    if (listed) {
        int texel = 3 * listed_index(page, at);
        ivec2 place = ivec2(texel % SEEN_COLUMNS, texel / SEEN_COLUMNS);
        vec2 past = texelFetch(seen_lobes, place + ivec2(2, 0), 0).xy;
        float base = past.x < 0.0 ? 0.0 : base_followed(s);
        float coat = past.y < 0.0 ? 0.0 : coat_followed(s);
        s.seen = mix(s.seen, texelFetch(seen_lobes, place, 0), base);
        s.coat_seen = mix(s.coat_seen, texelFetch(seen_lobes, place + ivec2(1, 0), 0), coat);
        s.sky_share = mix(s.sky_share, past.x, base);
        s.coat_sky_share = mix(s.coat_sky_share, past.y, coat);
    }
    return s;
}
