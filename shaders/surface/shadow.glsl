// Slope of a plane in the shadow map, depth 0..1 per texel along both axes of the map.
//
// n : geometric normal of the plane, turned into the light's axes and divided by the map's squared
//     scales, so that it is the plane's normal in clip space
// texels : edge of the map
vec2 plane_slope(vec3 n, float texels) {
    // dz/dx = -n.x / n.z in clip space; depth is half of z and a texel 2 / texels of x.
    return -n.xy / (abs(n.z) < 1e-9 ? 1e-9 : n.z) / texels;
}

// Fraction of a receiver's neighbourhood in the shadow map that is lit: a bilinear blend of 3 x 3
// texel tests. Each test compares with the depth of the receiver's own plane at that texel, so that
// a plane does not shadow itself at any incidence.
//
// map : depth of the nearest caster, 0..1 along the light
// p : receiver in the map's clip space
// plane : slope of the receiver's plane, depth 0..1 per texel
// unit_depth : depth 0..1 that is as long as a texel
float lit_fraction(sampler2D map, vec3 p, vec2 plane, float unit_depth) {
    // Rounding: 24-bit depth and float32 vertices are good to 1e-6 of the map's depth. The plane's
    // normal comes from differences of neighbouring positions, good to about 1e-3 rad, which at
    // incidence t tilts the plane by 1e-3 / cos^2 t = 1e-3 (1 + slope^2) over up to 3 texels.
    float slack = 4e-6 + 0.004 * (unit_depth + dot(plane, plane) / unit_depth);
    vec2 size = vec2(textureSize(map, 0));
    vec2 place = (0.5 * p.xy + 0.5) * size - 0.5;
    float depth = 0.5 * p.z + 0.5 - slack;
    ivec2 corner = ivec2(floor(place));
    vec2 f = place - vec2(corner);
    float lit = 0.0;
    for (int j = -1; j <= 2; ++j) {
        float wy = j == -1 ? 1.0 - f.y : (j == 2 ? f.y : 1.0);
        for (int i = -1; i <= 2; ++i) {
            float wx = i == -1 ? 1.0 - f.x : (i == 2 ? f.x : 1.0);
            ivec2 texel = corner + ivec2(i, j);
            float own = depth + dot(plane, vec2(texel) - place);
            float caster = texelFetch(map, clamp(texel, ivec2(0), ivec2(size) - 1), 0).r;
            lit += own <= caster ? wx * wy : 0.0;
        }
    }
    return lit / 9.0;
}
