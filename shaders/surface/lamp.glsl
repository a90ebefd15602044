#include "block/lamps"
#include "common/sun.glsl"
#include "surface/material.glsl"

uniform sampler2D lamp_maps;   // 1 / z of the nearest caster [m-1]; 0 where there is none

// A spot light, camera axes.
struct Lamp {
    vec3 place;         // [m]
    float radius;       // of the aperture [m]
    vec3 axis;          // unit, of the beam
    float half_angle;   // of the cone of full intensity [rad]
    vec4 intensity;     // [W sr-1]
    vec4 column;        // at v from the lamp, the map's texel is dot(v, xyz) / dot(v, axis) + w
    vec4 row;
    float edge;         // of the smooth fall around the cone [rad]
    ivec2 corner;       // of the lamp's map
};

Lamp lamp_at(int index) {
    int i = 6 * index;
    vec4 place = lamp_rows[i], axis = lamp_rows[i + 1], last = lamp_rows[i + 5];
    return Lamp(place.xyz, place.w, axis.xyz, axis.w, lamp_rows[i + 2], lamp_rows[i + 3],
                lamp_rows[i + 4], last.x, ivec2(last.yz));
}

// Intensity at an angle [rad] from the beam's axis over that within the cone.
float beam_profile(Lamp lamp, float angle) {
    return 0.5 + 0.5 * cos(PI * clamp((angle - lamp.half_angle) / lamp.edge, 0.0, 1.0));
}

// Share of a neighbourhood of the surface that a lamp reaches: 3 x 3 texel tests, weighted by a
// quadratic B-spline. Each test compares with the receiver's own plane at that texel, so that a
// plane does not shadow itself at any incidence.
//
// v : the surface from the lamp [m]
//
// With v = z (X, Y, 1) in lamp axes, the plane n.v = h has 1 / z = n.(X, Y, 1) / h: linear over the
// map.
float lamp_lit(Surface s, Lamp lamp, vec3 v) {
    vec3 n = dot(s.facet, v) < 0.0 ? s.facet : s.plain_n;
    vec2 per_tangent2 = vec2(dot(lamp.column.xyz, lamp.column.xyz),
                             dot(lamp.row.xyz, lamp.row.xyz));
    float texel = inversesqrt(min(per_tangent2.x, per_tangent2.y));   // as a tangent
    // The smooth surface that the normals stand for lies above its facets by the sagitta of an edge;
    // a quarter of a texel lifts the receiver there.
    v += s.plain_n * (0.25 * texel * dot(v, lamp.axis));
    float near = 1.0 / dot(v, lamp.axis);
    vec2 place = vec2(dot(lamp.column.xyz, v), dot(lamp.row.xyz, v)) * near
               + vec2(lamp.column.w, lamp.row.w) - 0.5;
    vec2 plane = vec2(dot(n, lamp.column.xyz), dot(n, lamp.row.xyz)) / per_tangent2
               / min(dot(n, v), -1e-9);
    // Rounding: positions in camera axes are good to 1e-7 of their size. The plane's normal, from
    // differences of neighbouring positions, is good to about 1e-3 rad, which at incidence t tilts
    // the plane by 1e-3 / cos^2 t over up to 3 texels.
    float slope2 = dot(plane, plane) / (near * near * texel * texel);
    float slack = near * (4e-6 + 4e-7 * length(s.place) * near + 0.004 * texel * (1.0 + slope2));
    ivec2 middle = clamp(ivec2(floor(place + 0.5)), ivec2(1), ivec2(lamp_map_size - 2));
    vec2 offset = clamp(place - vec2(middle), -0.5, 0.5);
    float expected = near + slack + dot(plane, vec2(middle) - place);
    vec2 low = 0.5 * (0.5 - offset) * (0.5 - offset), high = 0.5 * (0.5 + offset) * (0.5 + offset);
    vec3 wx = vec3(low.x, 1.0 - low.x - high.x, high.x);
    vec3 wy = vec3(low.y, 1.0 - low.y - high.y, high.y);
    float lit = 0.0;
    for (int j = -1; j <= 1; ++j) {
        ivec2 at = lamp.corner + middle + ivec2(0, j);
        vec3 caster = vec3(texelFetch(lamp_maps, at - ivec2(1, 0), 0).r,
                           texelFetch(lamp_maps, at, 0).r,
                           texelFetch(lamp_maps, at + ivec2(1, 0), 0).r);
        vec3 here = expected + float(j) * plane.y + plane.x * vec3(-1.0, 0.0, 1.0);
        lit += wy[j + 1] * dot(wx, vec3(lessThanEqual(caster, here)));
    }
    return lit;
}

// Radiance of the lamps' light that a surface turns to the viewer [W m-2 sr-1].
vec4 lamp_light(Surface s) {
    vec4 radiance = vec4(0.0);
    for (int i = 0; i < lamp_count; ++i) {
        Lamp lamp = lamp_at(i);
        vec3 v = s.place - lamp.place;
        float angle = atan(length(cross(v, lamp.axis)), dot(v, lamp.axis));
        float beam = beam_profile(lamp, angle);
        if (beam <= 0.0) continue;
        // Closer than its own radius a lamp is no point any more: the law stops there.
        float r = max(length(v), lamp.radius);
        vec3 wi = -normalize(v);
        float angular_radius = atan(lamp.radius, r);
        float facing = disc_cosine(dot(s.n, wi), angular_radius) * past_relief(s, wi);
        if (facing <= 0.0) continue;
        // With its centre below the surface's own horizon the disc is cut already.
        float lit = dot(s.n, wi) > 0.0 ? lamp_lit(s, lamp, v) : 1.0;
        if (lit <= 0.0) continue;
        float reached = beam * facing * lit / (r * r);
        Disc disc = Disc(wi, angular_radius, vec4(0.0), vec4(0.0));
        radiance += reflection(s, disc) * lamp.intensity * reached;
    }
    return radiance;
}
