// Mean photo-electrons from the irradiance of the image plane [W m-2 per band], of four neighbouring
// pixels of a row at a time; with LENS from the radiance that pixels see [W m-2 sr-1].
//
// Electrons = E * area * time * photons per joule * quantum efficiency, all of it folded per band
// into electrons_per_light [e- W-1 m2, with LENS e- W-1 m2 sr]: one row for each pixel of a square of
// 2 x 2, in the order (0, 0), (1, 0), (0, 1), (1, 1), which are alike without colour filters.
#include "block/exposure"
#include "common/texels.glsl"
#include "optics/off_axis.glsl"

uniform sampler2D light;

out vec4 electrons;

// Of a pixel with even column (x) and one with odd column (y) in this row, from the same light.
vec2 even_and_odd(int column) {
    int row = int(gl_FragCoord.y);
    // The last group may reach past the end of the row.
    ivec2 pixel = ivec2(min(column, textureSize(light, 0).x - 1), row);
    vec4 square = electrons_per_light * read_texel(light, pixel);
#ifdef LENS
    square *= off_axis(pixel, intrinsics);
#endif
#ifdef MOSAIC
    return (row & 1) == 0 ? square.xy : square.zw;
#else
    return square.xx;
#endif
}

void main() {
    int first = 4 * int(gl_FragCoord.x);
    electrons = vec4(even_and_odd(first).x, even_and_odd(first + 1).y, even_and_odd(first + 2).x,
        even_and_odd(first + 3).y);
}
