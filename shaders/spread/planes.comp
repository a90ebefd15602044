// The planes that a lens spreads, each weighted by each zone, two of these as one complex layer with
// black surroundings. Pixels beyond a plane's limit are left out, and their rectangle is kept; or,
// by EXCESS, only these are written.
#include "common/group.glsl"
#include "spread/plane.glsl"

layout(std430, binding = 0) readonly buffer Planes { Plane planes[]; };
// (ZONES, rows, columns) of the image: illumination, as much of it as belongs to a zone.
layout(std430, binding = 1) readonly buffer Illumination { float illumination[]; };
#ifdef EXCESS
// (ZONES * PLANES, rows, columns) of the rectangle.
layout(std430, binding = 2) writeonly buffer Excess { float excess[]; };
uniform ivec4 rectangle;  // x, y, columns, rows
#else
layout(std430, binding = 2) writeonly buffer Layers { vec2 layers[]; };
// From the first column and row to the last; the first is beyond the last where there are none.
layout(std430, binding = 3) buffer Bright { int bright[4]; };
uniform ivec2 size;  // of a layer
#endif

// Of the planes of all zones, one after the other.
float weighted(int number, vec4 light, int pixel, int pixels) {
    return plane_at(light, planes[number % PLANES], illumination[number / PLANES * pixels + pixel]);
}

#ifdef EXCESS
void main() {
    ivec2 place = ivec2(gl_GlobalInvocationID.xy), seen = textureSize(radiance, 0);
    if (any(greaterThanEqual(place, rectangle.zw))) return;
    ivec2 pixel = rectangle.xy + place;
    vec4 light = texelFetch(radiance, pixel, 0);
    for (int number = 0; number < ZONES * PLANES; ++number) {
        float value = weighted(number, light, pixel.y * seen.x + pixel.x, seen.x * seen.y);
        bool beyond = value > planes[number % PLANES].limit;
        excess[(number * rectangle.w + place.y) * rectangle.z + place.x] = beyond ? value : 0.0;
    }
}
#else
float usual(int number, vec4 light, ivec2 pixel, ivec2 seen) {
    if (number >= ZONES * PLANES) return 0.0;
    float value = weighted(number, light, pixel.y * seen.x + pixel.x, seen.x * seen.y);
    if (value <= planes[number % PLANES].limit) return value;
    atomicMin(bright[0], pixel.x);
    atomicMin(bright[1], pixel.y);
    atomicMax(bright[2], pixel.x);
    atomicMax(bright[3], pixel.y);
    return 0.0;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy), seen = textureSize(radiance, 0);
    if (any(greaterThanEqual(pixel, size))) return;
    bool inside = all(lessThan(pixel, seen));
    vec4 light = inside ? texelFetch(radiance, pixel, 0) : vec4(0.0);
    for (int layer = 0; layer < (ZONES * PLANES + 1) / 2; ++layer) {
        vec2 pair = vec2(0.0);
        if (inside) {
            pair.x = usual(2 * layer, light, pixel, seen);
            pair.y = usual(2 * layer + 1, light, pixel, seen);
        }
        layers[(layer * size.y + pixel.y) * size.x + pixel.x] = pair;
    }
}
#endif
