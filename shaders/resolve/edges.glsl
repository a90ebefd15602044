// The parts of a pixel on either side of a line that a surface ends at: known to the last digit, where
// five samples leave a tenth of the pixel open.

// Of each shading point the line along which its group ends in its cell (gbuffer/edge.glsl).
uniform sampler2D edges;

// Of the shares in a pixel along an axis, the part below a place [px from its middle].
vec4 part_below(vec4 at) {
    vec4 outer = 0.5 * (1.0 + ramps), inner = 0.5 * (1.0 - ramps);
    vec4 a = max(at + outer, 0.0), b = max(at + inner, 0.0);
    vec4 c = max(at - inner, 0.0), d = max(at - outer, 0.0);
    return (a * a - b * b - c * c + d * d) / (2.0 * ramps);
}

// The part of a pixel that lies inside a line, by the shares of places in it.
//
// line : unit normal, towards the inside, and how far inside the pixel's middle lies [px]
vec4 part_inside(vec3 line) {
    vec2 normal = abs(line.x) > abs(line.y) ? line.yx : line.xy;
    vec4 at = vec4(line.z / abs(normal.y));
    float lean = normal.x / abs(normal.y);
    // Along the axis that the line leans against less, a place is the sum of one in a pixel and one in a
    // ramp: by Gauss's nodes, four and two.
    const vec2 NODES = vec2(0.4305682, 0.1699905), WEIGHTS = vec2(0.1739274, 0.3260726);
    const float NODE = 0.2886751;
    vec4 part = vec4(0.0);
    for (int k = 0; k < 8; ++k) {
        vec2 side = 1.0 - 2.0 * vec2(k & 1, (k >> 1) & 1);
        vec4 along = side.x * NODES[k >> 2] + side.y * NODE * ramps;
        part += 0.5 * WEIGHTS[k >> 2] * part_below(at + lean * along);
    }
    return clamp(part, 0.0, 1.0);
}

// Takes the line of a group of a cell for that which divides a pixel if it crosses that and has more of
// other samples beyond it, or as many and lies nearer.
//
// rank : of the line that is chosen already
void choose_line(inout vec3 chosen, inout float rank, ivec2 cell, vec2 middle, mat2 to_raster) {
    bool known = cell == clamp(cell, ivec2(0), cells - 1) && is_known(cell);
    cell = clamp(cell, ivec2(0), cells - 1);
    uvec4 groups = groups_from(cell, 0);
    int page = page_of(read_texel(block_pages, cell / BLOCK).r);
    vec2 corner = middle - vec2(first_texel(cell));
    // A group that fills its cell ends nowhere in it.
    int left = known && samples_of(groups.x) < groups.x >> TEXELS ? 4 : 0;
    while (left > 0 && samples_of(groups.x) > 0u) {
        vec4 edge = read_texel(edges, texel_of_page(page) + (cell & 1));
        vec3 line = vec3(edge.xy * to_raster, edge.z + dot(edge.xy, corner));
        line /= max(length(line.xy), 1e-9);
        float reach = 0.5 * (1.0 + widest_ramp) * (abs(line.x) + abs(line.y));
        float its = edge.w - 0.1 * abs(line.z);
        bool better = abs(line.z) < reach && its > rank;
        chosen = better ? line : chosen;
        rank = better ? its : rank;
        groups = uvec4(groups.yzw, 0u);
        ++page;
        --left;
    }
}

// The line that divides a pixel, as `part_inside` takes it, of the groups of its cells, else of those
// around. 0 without any.
//
// cell : the pixel's first one
// middle, to_raster : of the pixel in the raster, and what a pixel right and down is there
vec3 line_across(ivec2 cell, vec2 middle, mat2 to_raster) {
    vec3 chosen = vec3(0.0);
    float rank = 0.0;
    for (int k = 0; k < cells_per_pixel * cells_per_pixel; ++k)
        choose_line(chosen, rank, cell + ivec2(k % cells_per_pixel, k / cells_per_pixel), middle, to_raster);
    int edge = cells_per_pixel + 2, end = rank > 0.0 ? 0 : edge * edge;
    for (int k = 0; k < end; ++k)
        choose_line(chosen, rank, cell + ivec2(k % edge, k / edge) - 1, middle, to_raster);
    return chosen;
}

// What a pixel gets of both sides of a line by the parts of it that these are.
//
// full, inner : sums over all samples, and over those inside
Sum by_sides(Sum full, Sum inner, vec3 line) {
    Sum outer = Sum(full.light - inner.light, full.covered - inner.covered, full.count - inner.count);
    // Without a sample on one side, nothing is known of it.
    bvec4 known = lessThan(max(inner.count, outer.count), (1.0 - 1e-5) * full.count);
    vec4 part = mix(inner.count / max(full.count, 1e-9), part_inside(line), known);
    vec4 inside = part / max(inner.count, 1e-9), outside = (1.0 - part) / max(outer.count, 1e-9);
    return Sum(inside * inner.light + outside * outer.light,
               inside * inner.covered + outside * outer.covered, vec4(1.0));
}
