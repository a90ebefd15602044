// Slope of a plane in the shadow map, depth 0..1 per texel along both axes of the map.
//
// n : geometric normal of the plane in the light's axes, of any length
// texels : edge of the map
vec2 plane_slope(vec3 n, float texels) {
    // The map is a cube: dz/dx = -n.x / n.z; depth is half of z and a texel 2 / texels of x.
    return -n.xy / (abs(n.z) < 1e-9 ? 1e-9 : n.z) / texels;
}

// Weights of three neighbouring texels in a quadratic B-spline, for an offset -0.5..0.5 from the
// middle one: smooth in the offset, so that a filtered edge has no steps.
vec3 spline_weights(float x) {
    return vec3(0.5 * (0.5 - x) * (0.5 - x), 0.75 - x * x, 0.5 * (0.5 + x) * (0.5 + x));
}

// Fraction of a receiver's neighbourhood in the shadow map that is lit: 3 x 3 texel tests, weighted
// by a spline. Each test compares with the depth of the receiver's own plane at that texel, so that
// a plane does not shadow itself at any incidence.
//
// map : depth of the nearest caster, 0..1 along the light
// p : receiver in the map's clip space
// plane : slope of the receiver's plane, depth 0..1 per texel
float lit_fraction(sampler2D map, vec3 p, vec2 plane) {
    // Rounding: 24-bit depth and float32 vertices are good to 1e-6 of the map's depth. The plane's
    // normal comes from differences of neighbouring positions, good to about 1e-3 rad, which at
    // incidence t tilts the plane by 1e-3 / cos^2 t = 1e-3 (1 + slope^2) over up to 3 texels.
    vec2 size = vec2(textureSize(map, 0));
    float texel = 1.0 / size.x;   // as a depth
    float slack = 4e-6 + 0.004 * (texel + dot(plane, plane) / texel);
    vec2 place = (0.5 * p.xy + 0.5) * size - 0.5;
    ivec2 middle = clamp(ivec2(floor(place + 0.5)), ivec2(1), ivec2(size) - 2);
    vec2 offset = clamp(place - vec2(middle), -0.5, 0.5);
    float depth = 0.5 * p.z + 0.5 - slack - dot(plane, place - vec2(middle));
    vec3 wx = spline_weights(offset.x), wy = spline_weights(offset.y);
    float lit = 0.0;
    for (int j = -1; j <= 1; ++j) {
        vec3 own = depth + float(j) * plane.y + plane.x * vec3(-1.0, 0.0, 1.0);
        vec3 caster = vec3(texelFetch(map, middle + ivec2(-1, j), 0).r,
                           texelFetch(map, middle + ivec2(0, j), 0).r,
                           texelFetch(map, middle + ivec2(1, j), 0).r);
        lit += wy[j + 1] * dot(wx, vec3(lessThanEqual(own, caster)));
    }
    return lit;
}
