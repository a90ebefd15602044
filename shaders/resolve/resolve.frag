// The shading points of a tile averaged over each pixel and laid over what is behind them. The mean over
// all samples of the pixel goes out as colour, the covered share as the second source, so that
// blending computes mean + (1 - share) * background in float32.
//
// WINDOW: the raster covers small spacecraft alone, in cells of four samples; a pixel's other samples are
// known to be empty.
// DISTORTED: the lens moves samples, so that each has its own way to a pixel.
// SEPARATE: the covered share goes into a texture of its own.
// SOFT: between a pixel and its neighbours samples belong to both, by a ramp: a pixel is a square
// convolved with a square of the ramp's width, which each band has of its own.
// BY_SAMPLES: then each sample near an edge has its own share in a pixel, else a cell has.
// WIDE_PAGES: some pages may be wide.
// EDGES: then a pixel is divided along the line that a surface ends at, and samples tell what is on
// either side.
#include "block/resolve"
#define GROUPED
#include "gbuffer/cells.glsl"

uniform sampler2D points;
uniform usampler2D block_pages;   // the first page of each block
#ifdef DISTORTED
// Coordinates in the pinhole's image that the middles of the pixels see, and whether a pixel is drawn
// through this pinhole.
uniform sampler2D places;

vec2 place(ivec2 pixel) {
    return texelFetch(places, pixel, 0).xy;
}

// What one pixel to the right, and one down, is in the pinhole's image; one-sided at the edges.
mat2 pixel_edges(ivec2 pixel) {
    ivec2 low = max(pixel - 1, 0), high = min(pixel + 1, textureSize(places, 0) - 1);
    vec2 across = place(ivec2(high.x, pixel.y)) - place(ivec2(low.x, pixel.y));
    vec2 down = place(ivec2(pixel.x, high.y)) - place(ivec2(pixel.x, low.y));
    vec2 span = vec2(max(high - low, 1));
    return mat2(across / span.x, down / span.y);
}
#endif


#ifdef SEPARATE
layout(location = 0) out vec4 radiance;
layout(location = 1) out vec4 share;
#else
layout(location = 0, index = 0) out vec4 radiance;
layout(location = 0, index = 1) out vec4 share;
#endif

#ifdef SOFT
#define Share vec4   // by band
#else
#define Share float
#endif

// Sums of the radiance, the covered and all samples.
struct Sum {
    vec4 light;
    Share covered, count;
};

#ifdef SOFT
// Along the edge of a pixel. GLSL 3.30 takes the length of an array of a block for no constant.
#define MAX_CELLS (cell_shares.length() / 3)
#endif

const Sum NOTHING = Sum(vec4(0.0), Share(0.0), Share(0.0));

void add(inout Sum sum, Sum more) {
    sum.light += more.light;
    sum.covered += more.covered;
    sum.count += more.count;
}

bool is_wide(uint first_page) {
#ifdef WIDE_PAGES
    return (first_page & WIDE) != 0u;
#else
    return false;
#endif
}

// The shading point of a group, by the first page of its cell's block; on a wide page the first point.
ivec2 texel_of_point(uint first_page, ivec2 cell, int layer) {
    return texel_of_page(page_of(first_page) + layer) + (is_wide(first_page) ? ivec2(0) : cell & 1);
}

// The radiance there. Over a wide page it is linear between the four points, and a little beyond them.
vec4 point(uint first_page, ivec2 cell, ivec2 at) {
    vec4 light = read_texel(points, at);
    if (is_wide(first_page)) {
        int width = width_of(first_page);
        vec2 place = (vec2(cell & (2 * width - 1)) + 0.5) / float(width) - 0.5;
        vec4 right = read_texel(points, at + ivec2(1, 0));
        vec4 below = mix(read_texel(points, at + ivec2(0, 1)), read_texel(points, at + 1), place.x);
        // Beyond them the end of a penumbra would go on below zero.
        light = max(mix(mix(light, right, place.x), below, place.y), 0.0);
    }
    return light;
}

vec4 point(uint first_page, ivec2 cell, int layer) {
    return point(first_page, cell, texel_of_point(first_page, cell, layer));
}

// All samples of a cell.
Sum cell_sum(ivec2 cell) {
    uvec4 groups = read_texel(cell_groups, cell);
    uint first_page = read_texel(block_pages, cell / BLOCK).r;
    Sum sum = Sum(vec4(0.0), Share(0.0), Share(float(groups.x >> TEXELS)));
    int layer = 0, count = count_of(groups);
    do {
        ivec2 at = texel_of_point(first_page, cell, layer);
        uint group = is_wide(first_page) ? groups.x : read_texel(point_groups, at).r;
        float samples = layer < count ? float(samples_of(group)) : 0.0;
        vec4 light = point(first_page, cell, at);
        sum.light += samples > 0.0 ? samples * light : vec4(0.0);
        sum.covered += samples;
    } while (++layer < count);
    return sum;
}

#ifdef SOFT
// Share of a sample by its distance from the pixel's middle [px], times the square of the ramps.
vec4 share_at(vec2 off) {
    vec4 outer = 0.5 * (1.0 + ramps), peak = min(vec4(1.0), ramps);
    return clamp(outer - abs(off.x), vec4(0.0), peak) * clamp(outer - abs(off.y), vec4(0.0), peak);
}
#endif

#ifdef WINDOW
// What a group of a cell gives a pixel, which sees some of its samples.
#ifdef SOFT
void add_group(inout Sum sum, ivec2 cell, uint first_page, uint group, mat4 seen, int layer) {
    const uvec4 PLACES = uvec4(1u, 2u, 1u << uint(STRIDE), 1u << uint(STRIDE + 1));
    vec4 samples = seen * vec4(notEqual(group & PLACES, uvec4(0u)));
    bool some = any(greaterThan(samples, vec4(0.0)));
#else
void add_group(inout Sum sum, ivec2 cell, uint first_page, uint group, uint seen, int layer) {
    float samples = float(samples_of(group & seen));
    bool some = samples > 0.0;
#endif
    vec4 light = point(first_page, cell, layer);
    sum.light += some ? samples * light : vec4(0.0);
    sum.covered += samples;
}

#ifndef SOFT
// Whether a place lies within the unit square about the origin. Of two neighbours one has their edge.
uint within(vec2 place) {
    return uint(all(greaterThanEqual(place, vec2(-0.5))) && all(lessThan(place, vec2(0.5))));
}
#endif

void main() {
    mat2 to_pixel = mat2(pixel_from_raster.xy, pixel_from_raster.zw);
    float count = window_samples;
#ifdef DISTORTED
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    if (texelFetch(places, pixel, 0).z == 0.0) discard;
    mat2 edges = pixel_edges(pixel);
    vec2 middle = place(pixel) - tile_origin;
    count *= abs(determinant(edges));
#else
    mat2 edges = mat2(1.0);
    vec2 middle = floor(gl_FragCoord.xy) + 0.5 - tile_origin;
#endif
    // From a texel to where the pixel is a unit square about the origin.
    mat2 to_square = inverse(edges) * to_pixel;
    vec2 origin = inverse(edges) * (window_origin - middle);
    // The cells within the pixel's bounds on the raster.
    mat2 back = inverse(to_square);
#ifdef SOFT
    float half_width = 0.5 * (1.0 + widest_ramp);
#else
    float half_width = 0.5;
#endif
    vec2 at = -(back * origin), reach = half_width * (abs(back[0]) + abs(back[1])) + 1.0;
    ivec2 first = clamp(ivec2(floor(max(0.5 * (at - reach), 0.0))), ivec2(0), cells);
    ivec2 last = ivec2(ceil(min(0.5 * (at + reach), vec2(cells))));
    Sum sum = NOTHING;
    for (int j = first.y; j < last.y; ++j) {
        Sum row = NOTHING;
        for (int i = first.x; i < last.x; ++i) {
            uvec4 groups = read_texel(cell_groups, ivec2(i, j));
            uint first_page = read_texel(block_pages, ivec2(i, j) / BLOCK).r;
            // Its four samples, without a loop, since llvmpipe ends all loops of a shader after
            // 65,535 turns together.
            vec2 corner = to_square * (2.0 * vec2(i, j) + 0.5) + origin;
#ifdef SOFT
            mat4 seen = mat4(share_at(corner), share_at(corner + to_square[0]),
                             share_at(corner + to_square[1]),
                             share_at(corner + to_square[0] + to_square[1]));
#else
            uint seen = within(corner) | within(corner + to_square[0]) << 1u
                      | within(corner + to_square[1]) << uint(STRIDE)
                      | within(corner + to_square[0] + to_square[1]) << uint(STRIDE + 1);
#endif
            add_group(row, ivec2(i, j), first_page, groups.x, seen, 0);
            if (samples_of(groups.y) > 0u) {
                add_group(row, ivec2(i, j), first_page, groups.y, seen, 1);
                add_group(row, ivec2(i, j), first_page, groups.z, seen, 2);
                add_group(row, ivec2(i, j), first_page, groups.w, seen, 3);
            }
        }
        add(sum, row);
    }
#ifdef SOFT
    radiance = sum.light / (count * ramps * ramps);
    share = sum.covered / (count * ramps * ramps);
#else
    radiance = sum.light / count;
    share = vec4(sum.covered / count);
#endif
}
#else
#if defined(SOFT) && !defined(DISTORTED)
// A cell as a whole: light, the covered share and all of it, by its share in a pixel. Of one that does
// not look the same all over the covered share is negative if its samples have to be weighted.
Sum soft_sum(ivec2 cell, vec4 all_of_it) {
    bool inside = all(greaterThanEqual(cell, ivec2(0))) && all(lessThan(cell, cells));
    cell = clamp(cell, ivec2(0), cells - 1);
    uvec4 groups = read_texel(cell_groups, cell);
    uint first_page = read_texel(block_pages, cell / BLOCK).r;
    uint in_first = samples_of(groups.x);
    bool lit = inside && in_first > 0u, mixed = lit && in_first < groups.x >> TEXELS;
    vec4 light = point(first_page, cell, 0);
    Sum sum = Sum(lit ? all_of_it * light : vec4(0.0), lit ? all_of_it : vec4(0.0), all_of_it);
    if (mixed) sum.covered = vec4(-1.0);
#ifndef BY_SAMPLES
    if (mixed) {
        Sum samples = cell_sum(cell);
        vec4 each = all_of_it / samples.count;
        vec4 covered = samples.covered.x < samples.count.x ? each * samples.covered : all_of_it;
        sum = Sum(each * samples.light, covered, all_of_it);
    }
#endif
    return sum;
}
#endif

#ifdef DISTORTED
// Which of four groups hold a sample; the place of that among them.
int place_in(uvec4 groups, uint bit, out bool held) {
    bvec4 holds = notEqual(groups & bit, uvec4(0u));
    held = any(holds);
    return holds.y ? 1 : holds.z ? 2 : holds.w ? 3 : 0;
}

// One sample. Without loops but for the rare cell of many groups: llvmpipe ends all loops of a shader
// after 65,535 turns together.
Sum sample_sum(ivec2 texel) {
    ivec2 cell = clamp(cell_of(texel), ivec2(0), cells - 1), place = texel - first_texel(cell);
    bool inside = all(greaterThanEqual(place, ivec2(0))) && all(lessThan(place, ivec2(STRIDE)));
    uint bit = inside ? 1u << uint(STRIDE * place.y + place.x) : 0u;
    uvec4 groups = read_texel(cell_groups, cell);
    bool held;
    int layer = place_in(groups, bit, held);
    bool more = !held && samples_of(groups.w) > 0u;
    if (more) {
        for (int from = 4; from < LAYERS && !held; from += 4)
            layer = from + place_in(groups_from(cell, from), bit, held);
    }
    uint first_page = read_texel(block_pages, cell / BLOCK).r;
    vec4 light = point(first_page, cell, layer);
    return Sum(held ? light : vec4(0.0), Share(held ? 1.0 : 0.0), Share(1.0));
}

// Sums over the samples of a pixel one by one; of a softened one by their shares in it.
//
// middle, to_raster : of the pixel in the raster, and what a pixel right and down is there
Sum sum_of_samples(vec2 middle, mat2 to_raster) {
    mat2 to_pixel = inverse(to_raster);
    float extent = max(abs(to_raster[0].x) + abs(to_raster[1].x),
                       abs(to_raster[0].y) + abs(to_raster[1].y));
#ifdef SOFT
    extent *= 1.0 + widest_ramp;
#endif
    // The middle of a texel that is counted lies within half the extent of a place in the first one.
    int reach = int(0.5 * extent + 0.501);
    ivec2 centre = ivec2(floor(middle));
    Sum sum = NOTHING;
    for (int j = -reach; j <= reach; ++j) {
        Sum row = NOTHING;
        for (int i = -reach; i <= reach; ++i) {
            ivec2 texel = centre + ivec2(i, j);
            vec2 off = to_pixel * (vec2(texel) + 0.5 - middle);
#ifdef SOFT
            vec4 part = share_at(off);
            if (all(lessThanEqual(part, vec4(0.0)))) continue;
            Sum one = sample_sum(texel);
            add(row, Sum(part * one.light, part * one.covered, part * one.count));
#else
            if (any(greaterThan(abs(off), vec2(0.5)))) continue;
            add(row, sample_sum(texel));
#endif
        }
        add(sum, row);
    }
    return sum;
}
#endif

#ifdef BY_SAMPLES
// Whether a place in the image lies where the tile's samples are known.
bool is_known(vec2 place) {
    return all(greaterThanEqual(place, core.xy)) && all(lessThan(place, core.zw));
}

// The same of a cell.
bool is_known(ivec2 cell) {
    return is_known((vec2(cell) + 0.5) / float(cells_per_pixel) + tile_origin);
}

#ifdef EDGES
#include "resolve/edges.glsl"

// Up to which along both axes samples tell of a side of the pixel's line that holds none of its own [px].
const float AROUND = 0.9;

// Weight of a sample by its distance from the pixel's middle [px].
vec4 weight_at(vec2 off) {
    return share_at(off) + (all(lessThan(abs(off), vec2(AROUND))) ? 1e-3 * ramps * ramps : vec4(0.0));
}
#else
#define weight_at share_at
#endif

// Sums over samples near a pixel, and over those inside the line that divides it.
struct Halves {
    Sum full, inner;
};

// Where a pixel lies.
struct Place {
    vec2 middle;      // in the raster
    mat2 to_pixel;    // from a texel to pixels
    vec3 line;        // that divides it, as `part_inside` takes it
};

bool is_inside(vec2 off, Place pixel) {
    return dot(pixel.line.xy, off) + pixel.line.z > 0.0;
}

// Adds the samples of a group by their shares in a pixel.
//
// corner : of the cell's window in the raster, from the pixel's middle
void add_samples(inout Halves sum, uint group, vec4 light, vec2 corner, Place pixel) {
    vec4 part = vec4(0.0), inner = vec4(0.0);
    uint left = group;
    do {
        vec2 off = pixel.to_pixel * (corner + vec2(next_texel(left)) + 0.5);
        vec4 one = weight_at(off);
        part += one;
        inner += is_inside(off, pixel) ? one : vec4(0.0);
    } while (left != 0u);
    bool some = group != 0u && any(greaterThan(part, vec4(0.0)));
    sum.full.light += some ? part * light : vec4(0.0);
    sum.full.covered += some ? part : vec4(0.0);
    sum.inner.light += some ? inner * light : vec4(0.0);
    sum.inner.covered += some ? inner : vec4(0.0);
}

// The same of four layers of a cell, from one on.
void add_groups(inout Halves sum, ivec2 cell, int layer, uvec4 groups, Place pixel) {
    uint first_page = read_texel(block_pages, cell / BLOCK).r;
    vec2 corner = vec2(first_texel(cell)) - pixel.middle;
    groups &= (1u << uint(TEXELS)) - 1u;
    add_samples(sum, groups.x, point(first_page, cell, layer), corner, pixel);
    add_samples(sum, groups.y, point(first_page, cell, layer + 1), corner, pixel);
    add_samples(sum, groups.z, point(first_page, cell, layer + 2), corner, pixel);
    add_samples(sum, groups.w, point(first_page, cell, layer + 3), corner, pixel);
}

// What some cells give a pixel, by their samples' shares in it, of four layers from one on. Returns
// whether a cell has more.
//
// cell : the pixel's first one; first, end : of the cells from there, along both axes
bool add_cells(inout Halves sum, ivec2 cell, int first, int end, int layer, Place pixel) {
    bool more = false;
    for (int j = first; j < end; ++j) {
        Halves row = Halves(NOTHING, NOTHING);
        for (int i = first; i < end; ++i) {
            ivec2 at = cell + ivec2(i, j), inside = clamp(at, ivec2(0), cells - 1);
            uvec4 groups = at == inside && is_known(at) ? groups_from(inside, layer) : uvec4(0u);
            add_groups(row, inside, layer, groups, pixel);
            more = more || samples_of(groups.w) > 0u;
        }
        add(sum.full, row.full);
        add(sum.inner, row.inner);
    }
    return more;
}

// Where all is covered both are sums of the same shares, in another order.
void settle(inout Sum sum) {
    bvec4 all_covered = greaterThan(sum.covered, (1.0 - 4e-6) * sum.count);
    sum.covered = mix(sum.covered, sum.count, all_covered);
}

// Sums over the samples of some cells by their shares in a pixel.
Sum sum_of_samples(ivec2 pixel, ivec2 cell, int first, int end) {
    mat2 to_raster = mat2(raster_from_pixel.xy, raster_from_pixel.zw), to_pixel = inverse(to_raster);
    vec2 middle = to_raster * (vec2(pixel) + 0.5 - tile_origin) + raster_origin;
    Place at = Place(middle, to_pixel, vec3(0.0));
    float width = 1.0 + widest_ramp;
#ifdef EDGES
    at.line = line_across(cell, middle, to_raster);
    width = max(width, 2.0 * AROUND);
#endif
    Halves sum = Halves(NOTHING, NOTHING);
    bool more = add_cells(sum, cell, first, end, 0, at);
    // Few cells have more than four groups.
    for (int layer = 4; layer < LAYERS && more; layer += 4)
        more = add_cells(sum, cell, first, end, layer, at);
    // Of all samples, also of those that see nothing. The middle of a texel that is counted lies within
    // half the extent of a place in the first one.
    float extent = width * max(abs(to_raster[0].x) + abs(to_raster[1].x),
                               abs(to_raster[0].y) + abs(to_raster[1].y));
    int reach = int(0.5 * extent + 0.501);
    ivec2 centre = ivec2(floor(middle));
    for (int j = -reach; j <= reach; ++j)
        for (int i = -reach; i <= reach; ++i) {
            ivec2 texel = centre + ivec2(i, j);
            vec2 off = to_pixel * (vec2(texel) + 0.5 - middle);
            vec4 part = is_known(vec2(pixel) + 0.5 + off) ? weight_at(off) : vec4(0.0);
            sum.full.count += part;
            sum.inner.count += is_inside(off, at) ? part : vec4(0.0);
        }
    settle(sum.full);
#ifdef EDGES
    settle(sum.inner);
    if (at.line.xy != vec2(0.0)) sum.full = by_sides(sum.full, sum.inner, at.line);
#endif
    return sum.full;
}
#endif

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Sum sum = NOTHING;
    // Row by row: thousands of samples added to one float32 would lose its last digits.
#ifdef DISTORTED
    mat2 to_raster = mat2(raster_from_pixel.xy, raster_from_pixel.zw);
    vec2 seen = place(pixel);
    if (texelFetch(places, pixel, 0).z == 0.0) discard;
    // A pixel across a cut is averaged from one of the parts alone, or its coverage would count twice.
    if (any(lessThan(seen, core.xy)) || any(greaterThanEqual(seen, core.zw))) discard;
    vec2 middle = to_raster * (seen - tile_origin) + raster_origin;
    // A pixel is small beside the curvature of the distortion: its edges are straight.
    sum = sum_of_samples(middle, to_raster * pixel_edges(pixel));
#elif defined(SOFT)
    // Cells that look the same all over, and of which no neighbour looks different, count as a whole.
    float per_pixel = float(cells_per_pixel);
    int first = int(floor(-0.5 * widest_ramp * per_pixel)), end = cells_per_pixel - first;
    bool lit = false, bare = false, mixed = false;
    for (int j = first; j < end; ++j) {
        Sum row = NOTHING;
        for (int i = first; i < end; ++i) {
            ivec2 offset = ivec2(floor((vec2(i, j) + 0.5) / per_pixel));
            // Beyond the tile's samples as at their edge.
            ivec2 known = clamp(pixel + offset, ivec2(core.xy), ivec2(core.zw) - 1);
            ivec2 corner = cells_per_pixel * (known - offset - ivec2(tile_origin));
            vec4 all_of_it = cell_shares[MAX_CELLS + i] * cell_shares[MAX_CELLS + j];
            Sum one = soft_sum(corner + ivec2(i, j), all_of_it);
            lit = lit || any(greaterThan(one.covered, vec4(0.0)));
            bare = bare || all(equal(one.covered, vec4(0.0)));
            mixed = mixed || one.covered.x < 0.0;
            add(row, one);
        }
        add(sum, row);
    }
#ifdef BY_SAMPLES
    if (mixed || lit && bare)
        sum = sum_of_samples(pixel, cells_per_pixel * (pixel - ivec2(tile_origin)), first, end);
#endif
#else
    ivec2 corner = cells_per_pixel * (pixel - ivec2(tile_origin));
    int j = 0;
    do {
        Sum row = NOTHING;
        int i = 0;
        do add(row, cell_sum(corner + ivec2(i, j))); while (++i < cells_per_pixel);
        add(sum, row);
    } while (++j < cells_per_pixel);
#endif
    radiance = sum.light / max(sum.count, 1e-6);
    // Drivers divide to the last digit but one, through which the Sun's disc would shine.
    vec4 covered = vec4(sum.covered), count = vec4(sum.count);
    share = mix(vec4(greaterThan(count, vec4(0.0))), covered / max(count, 1e-6), lessThan(covered, count));
}
#endif
