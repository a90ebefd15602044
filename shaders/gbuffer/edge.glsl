// The line along which a group of samples ends, where it is an edge of the triangle that they see.

// Samples on an edge lie on either side of it by rounding [texels].
const float ON_EDGE = 0.01;

// An edge of a triangle as a line in the window of a cell: its unit normal, and how far along that the
// window's corner lies from it [texels]. Towards the triangle, if the viewer sees the triangle's front.
//
// from, along : where the edge begins, and to its end [m]; first : the window's corner in the raster
vec3 line_of(vec3 from, vec3 along, vec2 first) {
    // The plane through the pinhole and the edge.
    vec3 plane = cross(from, along), sight = sight_at(first);
    vec2 slope = vec2(dot(plane, sample_steps[0].xyz), dot(plane, sample_steps[1].xyz));
    // From the small step between both, which keeps its digits.
    float value = -dot(along, cross(sight, sight * from.z - from));
    return vec3(slope, value) / max(length(slope), 1e-30);
}

// The edge of the triangle that has all samples of a group on one side, and most others of the cell on
// the other: its line, as `line_of`, towards the group, and the part of the others that lie beyond it. 0
// without such an edge.
vec4 edge_of(ivec2 cell, uint group, Facet f) {
    vec2 first = vec2(first_texel(cell));
    mat3 lines = mat3(line_of(f.corner, f.along, first), line_of(f.corner + f.along, f.up - f.along, first),
                      line_of(f.corner + f.up, -f.up, first));
    lines *= dot(f.corner, f.across) < 0.0 ? -1.0 : 1.0;
    vec3 wrong = vec3(0.0), beyond = vec3(0.0);
    float others = 0.0;
    for (int k = 0; k < TEXELS; ++k) {
        ivec2 texel = ivec2(k % STRIDE, k / STRIDE);
        bool in_group = (group >> uint(k) & 1u) != 0u;
        bool other = !in_group && cell_of(ivec2(first) + texel) == cell;
        vec3 inside = vec3(vec2(texel) + 0.5, 1.0) * lines;
        wrong += in_group ? vec3(lessThan(inside, vec3(-ON_EDGE))) : vec3(0.0);
        beyond += other ? vec3(lessThan(inside, vec3(ON_EDGE))) : vec3(0.0);
        others += float(other);
    }
    vec4 chosen = vec4(0.0);
    for (int k = 0; k < 3; ++k) {
        float part = wrong[k] == 0.0 ? beyond[k] / max(others, 1.0) : 0.0;
        if (part > chosen.w) chosen = vec4(lines[k], part);
    }
    return chosen;
}
