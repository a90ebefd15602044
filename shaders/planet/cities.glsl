// Cities: what of the map's lights shines where within its texels, which are wider than towns.
//
// Each scale has a grid along parallels and meridians with one town to a cell, wholly within it, so that
// a place belongs to one town alone. A town's light is random, by a power law of mean 1; so is the sum.

// The shipped map's mean square over its mean fifth power.
const float CITY_CORE = 5.18;
// Widest cell [km]; a parallel of these has so many around that all smaller ones fit in.
const float WIDEST_CELL = 24.0;

// Three numbers of 0..1 for a cell of a grid; 10 bits each.
vec3 of_cell(ivec2 cell, uint grid) {
    uint x = uint(cell.x) * 0x9e3779b9u + (uint(cell.y) + 7919u * grid) * 0x85ebca6bu;
    x ^= x >> 15; x *= 0x7feb352du;
    x ^= x >> 13;
    return (vec3(x & 1023u, (x >> 10) & 1023u, x >> 22) + 0.5) / 1024.0;
}

// Light over its mean of the towns of a grid, and the share of it that white lamps send.
//
// place : in cells of the grid
// radius, footprint : of a mean town, of the pixel, in cells; towns are at least as wide as that
vec2 towns(vec2 place, float radius, float footprint, uint grid) {
    // No row of cells begins where the next one does: towns would stand in columns.
    place.x += of_cell(ivec2(int(floor(place.y)), 0), grid + 2u).x;
    vec3 chance = of_cell(ivec2(floor(place)), grid);
    // Zipf's law, of exponent -1 in the number of towns: one of 37 has all light that a cell may; the mean is 1.
    float light = min(0.218 / chance.z, 8.0);
    // Brighter towns are wider, not brighter everywhere. To where light ends.
    float reach = min(3.2 * sqrt(radius * radius * light + 0.16 * footprint * footprint), 0.36);
    vec2 away = (fract(place) - mix(vec2(reach), vec2(1.0 - reach), chance.xy)) / reach;
    float fall = max(1.0 - dot(away, away), 0.0);
    // Over the mean of the fall's cube in the cell.
    float resolved = light * fall * fall * fall * (4.0 / PI) / (reach * reach);
    float even = clamp(2.0 * footprint - 0.4, 0.0, 1.0);
    return vec2(mix(resolved, 1.0, even), mix(step(0.6, fract(61.0 * chance.z)), 0.4, even));
}

// Radiance of lamps at a place [W m-2 sr-1].
//
// code : of the map of lights; its square is the mean radiance, a core is as much narrower as its
//        fifth power, of the same light over all land
// on_map : place on the maps
// footprint : of the pixel [km]
// road : light of roads over its mean
vec4 city_lights(float code, vec2 on_map, float footprint, float road) {
    float parallel = on_map.y * (PI * planet_km / WIDEST_CELL);
    float around = max(sin((floor(parallel) + 0.5) * (WIDEST_CELL / planet_km)), 0.02);
    vec2 place = vec2(on_map.x * (2.0 * PI * planet_km / WIDEST_CELL) * around, parallel);
    float spanned = footprint / WIDEST_CELL;
    vec2 town = towns(place, 0.10, spanned, 1u);
    vec2 village = towns(4.0 * place, 0.075, 4.0 * spanned, 2u);
    float mean = code * code, streets = 0.6 + 0.4 * road;
    float core = 0.25 * CITY_CORE * mean * mean * code * streets;
    vec3 parts = vec3(0.35 * town.x * streets, 0.3 * village.x, 0.1 * road) * mean;
    float white = dot(parts, vec3(town.y, village.y, 0.2)) + 0.4 * core;
    float sum = dot(parts, vec3(1.0)) + core;
    return (sum - white) * sodium_lamps + white * white_lamps;
}
