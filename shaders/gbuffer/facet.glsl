// A triangle, and where lines of sight meet it.

// A triangle in camera axes.
struct Facet {
    vec3 corner;      // [m]
    vec3 along, up;   // edges from there [m]
    vec3 across;      // their cross product
};

// Where a line of sight, at depth 1, meets the plane: parts of the edges from the corner.
vec2 parts_at(Facet f, vec3 sight) {
    float down = dot(sight, f.across);
    down = abs(down) > 1e-30 ? down : 1e-30;
    // The product of corner and line of sight, from the small step between them: that keeps its digits.
    vec3 product = cross(sight, sight * f.corner.z - f.corner);
    return vec2(dot(f.up, product), -dot(f.along, product)) / down;
}

// Weights of the corners there; past the edges not much farther.
vec3 weights_at(Facet f, vec3 sight) {
    vec2 w = clamp(parts_at(f, sight), -0.5, 1.5);
    return vec3(1.0 - w.x - w.y, w);
}

// From the place that one line of sight meets to that of another close by, as parts of the edges. A
// sliver is left by many of its widths; a plane seen edge-on is not followed out of the cell.
vec2 parts_between(Facet f, vec3 from, vec3 to) {
    vec2 parts = parts_at(f, to) - parts_at(f, from);
    float reach = 64.0 * length(to - from) * abs(f.corner.z);
    return parts * min(1.0, reach / max(length(mat2x3(f.along, f.up) * parts), 1e-30));
}
