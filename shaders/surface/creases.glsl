// What the planes around a receiver tell of light at creases.
//
// A texel tells of its middle. Near a crease that may lie on the other side, and what stands there says
// nothing of the receiver. The plane of what it shows does, continued to the receiver: only where it
// passes over the receiver can the surface shade it; and what lies across that plane is past the crease.

#include "common/texels.glsl"
#include "surface/receiver.glsl"

// What four texels show, and what it is to a receiver.
struct Planes {
    vec4 rise;       // over the receiver's own plane [m]
    mat4x2 slopes;   // height per texel [m]
    mat4x2 away;     // of the texels from the receiver's place [texels]
    bvec4 shading;   // a surface that passes over the receiver
    bvec4 same_surface;   // the receiver's own surface
};

// first : of the texels
// highest : over the receiver [m], of what counts as shading
Planes planes_at(sampler2D depths, sampler2D slopes, SunMap map, Receiver r, ivec2 first, float highest) {
    Planes planes;
    vec2 place = r.here.xy + r.foot.xy;
    float above = map.top - r.here.z - r.foot.z;
    for (int k = 0; k < 4; ++k) {
        ivec2 texel = first + ivec2(k & 1, k >> 1), at = texel + ivec2(map.column, 0);
        vec2 away = vec2(texel) + 0.5 - place;
        float high = above - map.depth * read_texel(depths, at).r;
        vec2 slope = -map.texel * read_texel(slopes, at).rg;
        float rise = high - dot(r.slope, away), bend = length(slope - r.slope);
        // On the line to the Sun, which leans against the map.
        float over = (high - r.seen.z - dot(slope, away - r.seen.xy)) / (1.0 - dot(slope, map.lean));
        float slack = 2.0 * r.slack + r.tilt * (abs(away.x) + abs(away.y));
        // Facets that turn by less than half a degree are one surface.
        bool bent = bend > 5.0 * r.tilt + 1e-6 * map.depth;
        float min_rise = r.flat_facet && bent ? r.exact : r.lift + slack;
        planes.shading[k] = rise > min_rise && over > 0.0 && over < highest;
        planes.same_surface[k] = rise <= (bent ? r.exact : r.lift + slack) && rise >= -slack - 1.5 / LIFT * r.lift;
        planes.rise[k] = rise;
        planes.slopes[k] = slope;
        planes.away[k] = away;
    }
    return planes;
}

// Which of the texels' middles lie, on the receiver's own plane, on its side of all that shades it.
vec4 this_side(Planes planes, Receiver r) {
    vec4 here = vec4(1.0);
    for (int j = 0; j < 4; ++j) {
        vec2 bend = planes.slopes[j] - r.slope;
        vec4 rise = planes.rise[j] + bend * planes.away - dot(bend, planes.away[j]);
        if (planes.shading[j]) here *= vec4(greaterThan(rise, vec4(r.exact)));
    }
    return here;
}
