// Light past sheets that meet at creases, by the planes of what the texels of a shadow map show.
//
// A texel tells of its middle. Near a crease that may lie on the other side of it, and what stands
// there says nothing of the receiver; but its plane, continued to the receiver, does: only where it
// passes over the receiver can what it belongs to shade it.

// Planes that four texels show, and what they are to a receiver.
struct Planes {
    vec4 rise;           // of each over the receiver's own plane [m]
    mat4x2 slopes;       // of each, height per texel [m]
    mat4x2 away;         // of the texels from the receiver's place [texels]
    bvec4 shading;       // over the receiver, continued to it
    bvec4 own;           // showing the receiver's own surface
};

// highest : over the receiver [m], of those that count as shading
Planes planes_at(sampler2D depths, sampler2D slopes, SunMap map, Receiver r, ivec2 first, float highest) {
    Planes planes;
    vec2 place = r.here.xy + r.foot.xy;
    float above = map.top - r.here.z - r.foot.z;
    for (int k = 0; k < 4; ++k) {
        ivec2 at = first + ivec2(k & 1, k >> 1) + ivec2(map.column, 0);
        vec2 away = vec2(first + ivec2(k & 1, k >> 1)) + 0.5 - place;
        float high = above - map.depth * texelFetch(depths, at, 0).r;
        vec2 slope = -map.depth * texelFetch(slopes, at, 0).rg;
        float rise = high - dot(r.slope, away);
        // Along a line to the Sun from the receiver, which leans against the map.
        float over = (high - r.seen.z - dot(slope, away - r.seen.xy)) / (1.0 - dot(slope, map.lean));
        float slack = 2.0 * r.slack + r.tilt * (abs(away.x) + abs(away.y));
        // Facets that turn by half a degree belong to one smooth surface.
        bool bent = length(slope - r.slope) > 5.0 * r.tilt + 1e-6 * map.depth;
        bool casting = rise > (r.flat_facet && bent ? r.exact : r.lift + slack);
        planes.rise[k] = rise;
        planes.slopes[k] = slope;
        planes.away[k] = away;
        planes.shading[k] = casting && over > 0.0 && over < highest;
        planes.own[k] = rise <= (bent ? r.exact : r.lift + slack) && rise >= -slack - 1.5 / LIFT * r.lift;
    }
    return planes;
}

// Lit share of the four texels nearest to an offset [texels] from a receiver, of those that tell of it.
//
// highest : no plane higher over the receiver shades it [m]
float lit_past_creases(sampler2D depths, sampler2D slopes, SunMap map, Receiver r, vec2 offset,
                       float highest) {
    vec2 place = r.here.xy + r.foot.xy + offset;
    ivec2 first = clamp(ivec2(floor(place - 0.5)), ivec2(0), ivec2(map.size - 2));
    Planes planes = planes_at(depths, slopes, map, r, first, highest);
    vec4 lit = vec4(planes.own);
    // What shows the receiver's own plane beyond a crease with a plane that shades it tells nothing.
    for (int j = 0; j < 4; ++j) {
        if (!planes.shading[j]) continue;
        vec2 bend = planes.slopes[j] - r.slope;
        for (int k = 0; k < 4; ++k)
            if (planes.rise[j] + dot(bend, planes.away[k] - planes.away[j]) <= r.exact) lit[k] = 0.0;
    }
    vec4 known = max(lit, vec4(planes.shading));
    vec2 weight = clamp(place - vec2(first) - 0.5, 0.0, 1.0);
    float all = mean_of(known, weight);
    return all > 0.0 ? mean_of(lit, weight) / all : 1.0;
}

// Those of a group's samples that no plane shades to which the Sun is a point.
//
// reach : texels per metre of height to the disc's edge
uint past_creases(sampler2D depths, sampler2D slopes, SunMap map, Samples samples, float reach) {
    uint left = samples.group, past = 0u;
    do {
        uint sample_bit = lowest_of(left);
        Receiver r = next_receiver(samples, left);
        bool lit = lit_past_creases(depths, slopes, map, r, vec2(0.0), 0.5 / reach) > 0.5;
        past |= lit ? sample_bit : 0u;
    } while (left != 0u);
    return past;
}
