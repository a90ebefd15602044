// Planes over the casters of a map. For each cell of 8 x 8 texels a plane along the surface in its
// middle, so far moved towards the light that no texel of the cell stands over it; with JOINED, none of
// the cells around it either.
#include "block/planes"
#include "common/texels.glsl"

uniform sampler2D source;   // depths; with JOINED such planes

// Change of depth from one column and one row to the next, depth at the cell's middle.
out vec4 plane;

// Nearest depth of texels over a plane through a cell's middle, where the plane of another cell lies under
// them.
float nearest_over(vec4 centre, vec4 other, vec2 away) {
    vec2 bend = abs(other.xy - centre.xy);
    return other.z - dot(centre.xy, away) - 3.5 * (bend.x + bend.y);
}

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy) - ivec2(int(first_column), 0);
#ifdef JOINED
    ivec2 last = textureSize(source, 0) - 1;
    plane = read_texel(source, at);
    vec4 centre = plane;
    for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i) {
            ivec2 other = clamp(at + ivec2(i, j), ivec2(0), last);
            plane.z = min(plane.z, nearest_over(centre, read_texel(source, other), 8.0 * vec2(other - at)));
        }
#else
    ivec2 first = 8 * at + ivec2(int(source_column), 0);
    float low = read_texel(source, first + 1).r, high = read_texel(source, first + 6).r;
    float right = read_texel(source, first + ivec2(6, 1)).r;
    float up = read_texel(source, first + ivec2(1, 6)).r;
    vec2 slope = vec2(right - low + high - up, up - low + high - right) / 10.0;
    plane = vec4(slope, 1e9, 0.0);
    vec2 width = 1.0 / vec2(textureSize(source, 0));
    for (int j = 0; j < 8; ++j)
        for (int i = 0; i < 8; ++i) {
            float depth = read_texel(source, first + ivec2(i, j), width).r;
            plane.z = min(plane.z, depth - dot(slope, vec2(i, j) - 3.5));
        }
#endif
}
