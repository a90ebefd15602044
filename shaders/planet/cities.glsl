// Cities: what of the map's lights shines where within its texels, which are wider than towns.
//
// Each scale has a grid along parallels and meridians with one town to a cell, wholly within it, so that
// a place belongs to one town alone. A town's light is random, by a power law of mean 1; so is the sum.
#include "block/planet"

// The shipped map's mean square over its mean fifth power.
const float CITY_CORE = 5.18;

uint scrambled(uint x) {
    x ^= x >> 16; x *= 0x7feb352du;
    x ^= x >> 15; x *= 0x846ca68bu;
    return x ^ (x >> 16);
}

// Four numbers of 0..1 for a cell of a grid.
vec4 of_cell(ivec2 cell, uint grid) {
    uint x = scrambled(uint(cell.x) + 0x9e3779b9u * (uint(cell.y) + 7919u * grid));
    uint y = scrambled(x + 0x85ebca6bu);
    return vec4(x & 0xffffu, x >> 16, y & 0xffffu, y >> 16) / 65535.0;
}

// Light over its mean of the towns of a grid, and the share of it that white lamps send.
//
// on_map : place on the maps
// cell, radius : of the grid and of a mean town [km]
// footprint : of the pixel [km]; towns are at least as wide as it
vec2 towns(vec2 on_map, float cell, float radius, float footprint, uint grid) {
    float parallel = on_map.y * PI * planet_km / cell;
    float row = floor(parallel);
    float around = 2.0 * planet_km * PI * max(sin((row + 0.5) * cell / planet_km), 0.02) / cell;
    vec2 place = vec2(on_map.x * around, parallel);
    vec4 chance = of_cell(ivec2(floor(place)), grid);
    // A power law, of which one of 120 is cut; with that the mean is 1.
    float light = min(0.438 * pow(max(chance.z, 1e-4), -0.6), 8.0);
    // Brighter towns are wider, not brighter everywhere. To where light ends, in cells.
    float wide = radius * (0.6 + 0.8 * chance.w) * sqrt(light);
    float reach = min(3.2 * sqrt(wide * wide + 0.16 * footprint * footprint) / cell, 0.49);
    vec2 away = (fract(place) - mix(vec2(reach), vec2(1.0 - reach), chance.xy)) / reach;
    float fall = max(1.0 - dot(away, away), 0.0);
    // Over the mean of the fall's cube in the cell.
    float resolved = light * fall * fall * fall * 4.0 / (PI * reach * reach);
    float white = step(0.6, fract(chance.w * 7.0 + chance.x));
    float smooth_share = smoothstep(0.25, 0.7, footprint / cell);
    return vec2(mix(resolved, 1.0, smooth_share), mix(white, 0.4, smooth_share));
}

// Radiance of lamps at a place [W m-2 sr-1].
//
// code : of the map of lights; its square is the mean radiance, a core is as much narrower as its
//        fifth power, of the same light over all land
// road, street : light of roads between towns and within them over its mean
vec4 city_lights(float code, vec2 on_map, float footprint, float road, float street) {
    vec4 light = vec4(0.0);
    WHEN(code > 0.0) {
        vec2 city = towns(on_map, 37.0, 4.0, footprint, 1u);
        vec2 town = towns(on_map, 13.0, 1.1, footprint, 2u);
        vec2 village = towns(on_map, 5.9, 0.4, footprint, 3u);
        float mean = code * code, streets = 0.6 + 0.4 * street;
        float core = 0.25 * CITY_CORE * mean * mean * code * streets;
        vec4 parts = vec4(0.2 * city.x * streets, 0.25 * town.x, 0.2 * village.x, 0.1 * road) * mean;
        float white = dot(parts, vec4(city.y, town.y, village.y, 0.2)) + 0.4 * core;
        float sum = dot(parts, vec4(1.0)) + core;
        light = (sum - white) * sodium_lamps + white * white_lamps;
    }
    return light;
}
