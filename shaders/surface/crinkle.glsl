// Facets of a crumpled foil: Voronoi cells of points in a bent grid of body axes, each with its own
// tilt and bow, and small ones within large ones. All slopes together follow GGX's distribution, so
// that a widened lobe is what many facets look like from afar.

// Three random words of a place in a grid (pcg3d of Jarzynski & Olano 2020).
uvec3 grid_hash(ivec3 place) {
    uvec3 v = uvec3(place) * 1664525u + 1013904223u;
    v.x += v.y * v.z; v.y += v.z * v.x; v.z += v.x * v.y;
    v ^= v >> 16u;
    v.x += v.y * v.z; v.y += v.z * v.x; v.z += v.x * v.y;
    return v;
}

// 0..1 from random words.
vec3 unit_random(uvec3 words) {
    return (vec3(words >> 8u) + 0.5) / 16777216.0;
}

// Root mean square of the slopes within a facet by its bow, in units of its tilt's.
const float FACET_BOW = 0.35;
// Root mean square of the distance from a facet's point along one axis, in units of the facet size.
const float FACET_SPREAD = 0.27;
// Shares of the large and the small facets in the slopes; with their bows the squares sum to 1.
const vec2 FACET_SHARES = vec2(0.85, 0.411);
const float SMALL_FACETS = 0.31;   // size, in units of the large ones'

// Normally distributed slopes of a facet, of standard deviation 1, as a vector square to n.
//
// p : place in body axes, in units of the facet size; n : unit, body axes; stream : of random words
// random : gets words 0..1 of the facet
vec3 facet_slopes(vec3 p, vec3 n, int stream, out vec3 random) {
    // Facets of one size would look like foam.
    p += 0.35 * sin(1.3 * p.yzx + vec3(0.0, 2.0, 4.0));
    ivec3 corner = ivec3(floor(p - 0.5));
    float nearest = 1e9;
    vec3 from_point = vec3(0.0);
    ivec3 facet = corner;
    for (int k = 0; k < 8; ++k) {
        ivec3 at = corner + ivec3(k & 1, (k >> 1) & 1, k >> 2);
        vec3 offset = p - vec3(at) - 0.5 - 0.9 * (unit_random(grid_hash(at + stream)) - 0.5);
        float distance2 = dot(offset, offset);
        if (distance2 < nearest) {
            nearest = distance2;
            from_point = offset;
            facet = at;
        }
    }
    random = unit_random(grid_hash(facet + stream + 4096));
    float z = 2.0 * random.y - 1.0, turn = 2.0 * PI * random.z;
    vec3 towards = vec3(sqrt(1.0 - z * z) * vec2(cos(turn), sin(turn)), z);
    towards -= n * dot(n, towards);
    vec3 tilt = sqrt(-2.0 * log(random.x)) * towards / max(length(towards), 1e-6);
    float bow = FACET_BOW / FACET_SPREAD * (random.z > 0.5 ? 1.0 : -1.0);
    return tilt + bow * (from_point - n * dot(n, from_point));
}

// Two GGX widths a, b one after the other have about the peak of one, c, where a^p + b^p = c^p, to
// 2 % of c^2 (by quadrature of their convolution, which is none of GGX): half of p, for alpha^2.
const float HALF_POWER = 0.635;

// alpha^2 of a lobe that slopes of another alpha^2 widen.
float widened(float a2, float b2) {
    return pow(pow(a2, HALF_POWER) + pow(b2, HALF_POWER), 1.0 / HALF_POWER);
}

// What a sample's footprint leaves of a crumpled foil's facets, the large and the small ones.
struct Crinkle {
    vec2 shares;   // of their slopes in the normal
    float hidden;  // alpha^2 of a lobe for the slopes that vary within the footprint
};

// footprint : edge of the sample's footprint on the surface [m]
// size, slope : mean spacing of the large facets [m], and the width of all slopes
Crinkle crinkle_of(float footprint, float size, float slope) {
    vec2 facets = footprint / (size * vec2(1.0, SMALL_FACETS));
    Crinkle c;
    vec2 shares = FACET_SHARES * (1.0 - smoothstep(vec2(0.5), vec2(2.0), facets));
    // Of the bow, only what differs from sample to sample.
    vec2 within = min(facets / (sqrt(12.0) * FACET_SPREAD), vec2(1.0));
    vec2 bow2 = FACET_BOW * FACET_BOW * (1.0 - within * within);
    float resolved2 = dot(shares * shares, 1.0 + bow2);
    // What the samples' normals do not show, the lobe has to.
    c.shares = slope * shares;
    c.hidden = 2.0 * slope * slope
             * pow(max(1.0 - pow(resolved2, HALF_POWER), 0.0), 1.0 / HALF_POWER);
    return c;
}

// Normal of a crumpled foil at a place.
//
// place, n : body axes [m], unit; size : mean spacing of the large facets [m]
vec3 crinkled_normal(vec3 place, vec3 n, float size, Crinkle c) {
    vec3 random;
    vec3 tilt = c.shares.x * facet_slopes(place / size, n, 0, random);
    // Normal slopes over the root of an exponential variable, one for a large facet and what lies in
    // it, are GGX's; the 3 % that would be steepest are brought down.
    float stretch = inversesqrt(max(-log(fract(random.x + random.y)), 0.03));
    tilt += c.shares.y * facet_slopes(place / (SMALL_FACETS * size), n, 7919, random);
    return normalize(n + stretch * tilt);
}
