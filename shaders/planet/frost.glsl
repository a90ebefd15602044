// Sea ice and snow: how much of a place they cover at this time of the year (simgl/scene/frost.py).
#include "block/planet"

// By longitude and month: latitudes [deg] to which sea ice comes from the north and from the south, and
// snow on land from the north.
uniform sampler2D frost_edges;

#ifndef BANDS
// Of dry snow on open ground, R, G, B, N.
const vec4 SNOW = vec4(0.80, 0.81, 0.82, 0.70);
// Of an ice sheet where it never melts (Grenfell et al. 1994, J. Geophys. Res. 99, 18669).
const vec4 DRY_SNOW = vec4(0.96, 0.97, 0.97, 0.88);
#else
#define SNOW snow_in_bands
#define DRY_SNOW dry_snow_in_bands
#endif
const float ANTARCTICA = -60.0;
// Within its edge a thirtieth of the pack is open water.
const float PACK = 0.97;

vec3 edges_at(vec2 on_map) {
    return textureLod(frost_edges, vec2(on_map.x, year_share), 0.0).xyz;
}

float degrees_north(vec2 on_map) {
    return 180.0 * (0.5 - on_map.y);
}

// Share of the sea that ice covers.
//
// grain : noise that frays the edge
float ice_share(vec2 on_map, float north, float grain) {
    vec3 edges = edges_at(on_map);
    float inside = north > 0.0 ? north - edges.x : edges.y - north;
    return PACK * smoothstep(-1.2, 1.2, inside + 0.7 * grain);
}

// Reflectance of land under the snow that lies there. Trees stand out of it: what is dark in red and
// grows stays dark.
//
// steepness : tangent of the map's slope; snow comes earlier to mountains
// kind : what grows, how dark that is in red, how white the map is (BANDS)
vec4 with_snow(vec4 land, float growth, vec3 kind, vec2 on_map, float steepness, float grain) {
    float north = degrees_north(on_map);
#ifdef BANDS
    if (north < ANTARCTICA) return mix(land, DRY_SNOW, kind.z);
#else
    if (north < ANTARCTICA) return max(land, DRY_SNOW * smoothstep(0.2, 0.5, land.b));
#endif
    float inside = north - edges_at(on_map).z + min(60.0 * steepness, 6.0);
    float share = smoothstep(-2.0, 2.0, inside + 1.0 * grain);
#ifdef BANDS
    // Beyond 1400 nm snow is darker than land.
    return mix(land, mix(SNOW, land + 0.15 * SNOW, growth * kind.y), share);
#else
    float trees = growth * clamp(1.5 - 12.0 * land.r, 0.0, 0.85);
    vec4 snow = mix(SNOW, land + 0.12, trees);
    return mix(land, max(land, snow), share);
#endif
}
