// Places that light may reach, on a shadow map (surface/shadow.glsl).

// SHEETS: some casters are open. What they need would cost solids a seventh of the time.
#ifdef SHEETS
const bool SOLID = false;
#else
const bool SOLID = true;
#endif

struct SunMap {
    float texel;   // edge [m]
    float top;     // height [m] of depth 0
    float depth;   // [m] from there to depth 1
    int size;      // texels along an edge
    int column;    // of its first texel in the textures
    int bounds;    // column of its first cell in the texture of bounds
    vec2 width;    // of a texel, as a part of the texture that is searched
    vec2 lean;     // of the line to the Sun's middle: texels per metre of height
    int taps;      // directions that stand for the disc, at most 128
};

// A place that light may reach, and its own surface: what lies in that casts nothing on it.
struct Receiver {
    vec3 here;     // column, row [texels] and height [m]; beside a steep surface, not in it
    vec2 slope;    // of the surface, height per texel [m]
    float drop;    // so far the surface lies below `here` [m]
    float slack;   // by so much rounding moves a height [m]
    float tilt;    // and by so much for each texel of distance
    float lift;    // and the triangle itself so far below that surface [m]
    float step;    // a step on it lower than this is low to the disc [m]
    float exact;   // so far from its plane a map may show the triangle [m]
    vec3 foot;     // from `here` to its place on the triangle
    vec3 seen;     // and on from there a little towards the viewer
    bool flat_facet;   // the triangle is the surface, and not a facet of a smooth one
};

// A receiver stands so far over its triangle [texels].
const float LIFT = 0.25;

// So far towards the viewer lies what is certainly on the viewer's side of all that meets the receiver's
// surface there [texels]: rounding moves a place by less.
const float SEEN = 0.05;

// Height of a step, texels over the receiver's surface: up to the one it counts as low, from the other
// on not.
const float LOW_STEP = 1.0, HIGH_STEP = 3.0;

// Height of one texel over the receiver's surface, along the light [m].
float texel_height(Receiver r) { return r.lift / LIFT; }

// A receiver in a surface.
//
// place : column, row [texels] and height [m] on the triangle
// n, smooth_n, to_viewer : unit vectors in the light's axes: normal of the receiver's plane, of the
// smooth surface there, and the way to the camera
//
// A map's texel tells of its middle. There a surface along the light has risen by many texels, past
// what stands over it, which then would seem to lie in it. So the receiver of a steep one is moved
// out of it: as far as its own texel's middle can lie towards it, and where it rises past all that may
// stand near, as far as the middles can that smooth an edge.
Receiver receiver_at(SunMap map, vec3 place, vec3 n, vec3 smooth_n, vec3 to_viewer) {
    vec2 gradient = -n.xy / max(n.z, 1e-9);
    float grade = length(gradient);
    Receiver r;
    float offset_texels = 0.75 * (smoothstep(8.0, 24.0, grade) + smoothstep(60.0, 180.0, grade));
    // The smooth surface that the normals stand for lies above its facets by the sagitta of an edge;
    // a quarter of a texel lifts the receiver there.
    vec3 texels = vec3(1.0, 1.0, map.texel);
    r.foot = vec3(offset_texels * gradient / max(grade, 1e-9), 0.0) - LIFT * smooth_n * texels;
    r.here = place - r.foot;
    r.seen = SEEN * to_viewer * texels;
    r.flat_facet = dot(n, smooth_n) > 1.0 - 1e-6;
    r.slope = gradient * map.texel;
    r.drop = offset_texels * grade * map.texel;
    // Rounding: 24-bit depth and float32 vertices are good to a few 1e-7 of the map's depth. Facets that
    // meet in a shallow valley rise out of each other's planes, the more the farther aside the receiver
    // stands: 1e-3 rad between them at incidence t are 1e-3 / cos^2 t = 1e-3 (1 + slope^2) of height a
    // length, twice that is allowed; beside the steepest surfaces it no longer matters.
    float bounded = min(grade, 60.0);
    r.tilt = 0.002 * map.texel * (1.0 + bounded * bounded);
    r.slack = 1e-6 * map.depth + r.tilt * (1.0 + 8.0 * offset_texels);
    r.lift = LIFT * map.texel * sqrt(1.0 + grade * grade);
    r.step = 0.5 * (LOW_STEP + HIGH_STEP) * texel_height(r);
    // The triangle's own plane comes from its corners: in the depths a few bits are lost, and in the
    // place on the map a ten thousandth of a texel.
    r.exact = 2e-7 * map.depth + 2e-4 * map.texel * grade;
    return r;
}

// How high above the receiver its own surface may stand at an offset [texels] from it.
float receiver_plane(Receiver r, vec2 offset) {
    return dot(r.slope, offset) - r.drop + r.slack + r.tilt * (abs(offset.x) + abs(offset.y));
}

// Whether a texel shows neither a caster nor the receiver's own surface: that ends before the texel's
// middle, or is met there by a sheet that still lies below `here`. Beside a crease such a texel lies on
// the other side of it, and tells nothing of the receiver. A curved surface falls off by less than 1.5
// texels.
//
// high : of what it shows, no caster; plane : receiver_plane there
bool beyond_receiver(Receiver r, float high, float plane, vec2 offset) {
    float slack = r.slack + r.tilt * (abs(offset.x) + abs(offset.y));
    float over = high + r.lift + slack - plane;
    return over > r.exact || over < -2.0 * slack - 1.5 / LIFT * r.lift;
}
