// The weather of the whole Earth, one texel of an equirectangular map.
//
// Clouds follow a climate drawn by hand after satellite means (ISCCP, MODIS): storms with anvils in a
// belt near the equator, clear subtropics with cumulus, storm tracks with fronts wound into commas and
// open cells in the cold air behind them, decks of stratocumulus west of the continents, few clouds over
// deserts. What the albedo by that lacks, a coarse map adds in cover and thickness. Where clouds are
// shallow, their cover is even over hundreds of kilometres, and what they are made of shows.
// `cover_shift` brings their mean to the wanted cover.
#include "common/constants.glsl"
#include "block/weather"
#include "planet/cloud.glsl"
#include "planet/noise.glsl"

uniform sampler2D swirls;    // where the air of a place came from, ITRF unit vector
uniform sampler2D commas;    // of depressions: deep cloud, cold air, ice cloud
uniform sampler2D anvils;    // of storms: ice blown off towers, the towers
uniform sampler2D amounts;   // what a place has beside the climate below: cover, logarithm of thickness
uniform sampler2D land_map;  // square roots of reflectance
uniform sampler2D shore_map; // distance to the shore

out vec4 weather;   // share of cloud, thickness code, thin high cloud, kind (planet/puffs.glsl)

const float EARTH_KM = 6371.0;

float bump(float x, float centre, float width) {
    float t = (x - centre) / width;
    return exp(-t * t);
}

vec4 noise_at(vec3 place, float tile_km) {
    return textureLod(noise_volume, noise_place(place * EARTH_KM, tile_km), 0.0) - 0.5;
}

vec2 on_map(vec3 n) {
    return vec2(atan(n.y, n.x) / (2.0 * PI) + 0.5, 0.5 - atan(n.z, max(length(n.xy), 1e-4)) / PI);
}

void main() {
    vec2 uv = gl_FragCoord.xy / map_size;
    float latitude = (0.5 - uv.y) * PI, longitude = (uv.x - 0.5) * 2.0 * PI;
    float degrees = latitude * 180.0 / PI, east = longitude * 180.0 / PI;
    vec3 here = vec3(cos(latitude) * vec2(cos(longitude), sin(longitude)), sin(latitude));
    vec3 origin = textureLod(swirls, uv, 0.0).xyz;
    // Each seed cuts the volume elsewhere.
    vec3 air = origin + seed_shift.xyz, local = here + seed_shift.xyz;

    // Each scale is drawn out by the one above it, which makes bands and wisps of blots.
    vec4 wide = noise_at(air, 11000.0);
    vec3 drawn = air + 0.10 * wide.xyz;
    vec4 fronts = noise_at(drawn.zxy, 4500.0);
    drawn += 0.035 * fronts.xyz;
    vec4 groups = noise_at(mix(drawn, local, 0.3).yzx, 1700.0);
    vec4 cells = noise_at(local + 0.25 * (drawn - local) + 0.01 * groups.xyz, 700.0);
    vec4 tufts = noise_at(local.zxy + 0.005 * cells.xyz, 260.0);
    // The map's texels crowd at the poles, where what is finer along them would show as rays.
    tufts *= clamp(5.0 * cos(latitude), 0.0, 1.0);

    // The belt of the towers wanders about 6 deg N, with breaks.
    float wander = 5.0 * sin(2.0 * longitude + 9.0 * seed_shift.x) + 12.0 * wide.w;
    float belt = bump(degrees, 6.0 + wander, 6.5);
    float storms = bump(degrees, 52.0, 15.0) + 1.6 * bump(degrees, -55.0, 15.0);
    float clear = bump(degrees, 22.0, 11.0) + bump(degrees, -21.0, 10.0);

    vec4 land = textureLod(land_map, uv, 4.0);
    land *= land;
    float on_land = step(textureLod(shore_map, uv, 0.0).r, 0.5);
    float desert = on_land * clamp((land.r - land.b - 0.06) * 6.5, 0.0, 1.0);

    float deck = 0.0;
    for (int k = 0; k < decks.length(); ++k)
        deck += bump(degrees + 30.0 * fronts.x + 12.0 * groups.x, decks[k].x, decks[k].z)
              * bump(east + 40.0 * fronts.y + 12.0 * groups.y, decks[k].y, decks[k].w);
    deck *= 1.0 - on_land;

    float polar = bump(degrees, 76.0, 12.0) + bump(degrees, -67.0, 9.0);
    float sea = 1.0 - on_land;

    // Fronts and anvils are frayed by the noise that they are seen through.
    vec4 comma = textureLod(commas, on_map(here + 0.05 * fronts.xyz + 0.02 * groups.xyz + 0.01 * cells.xyz), 0.0);
    vec4 anvil = textureLod(anvils, on_map(here + 0.006 * cells.xyz + 0.003 * tufts.xyz), 0.0);
    // No kind of cloud ends along a parallel.
    float wound = degrees + 14.0 * fronts.z + 7.0 * groups.z;
    float trades = bump(wound, 20.0, 12.0) + bump(wound, -20.0, 12.0);
    float rain = clamp(1.6 * belt + 1.2 * wide.w + 0.1 * on_land - 1.5 * clear * sea - 2.0 * desert - deck, 0.0, 1.0);
    anvil *= smoothstep(0.25, 0.6, rain);

    // Shares of shallow clouds: cumulus in the trades and on land by day, open cells, decks.
    float front = comma.r * (1.0 - 0.7 * desert);
    float deep = max(front, anvil.r);
    float cumulus = clamp(1.3 * trades + 0.8 * belt, 0.0, 0.9) * (1.0 - 0.5 * on_land) * (1.0 - deep);
    float track = smoothstep(38.0, 46.0, abs(wound)) * smoothstep(72.0, 62.0, abs(wound)) * sea * (1.0 - deep);
    float cold = clamp(comma.g + smoothstep(0.0, 0.15, wide.w), 0.0, 1.0) * track;
    float decked = clamp(1.4 * deck + (1.0 - cold) * track, 0.0, 1.0) * (1.0 - deep);

    float climate = 0.4 * polar + 0.34 * belt + 0.34 * storms - 0.26 * clear - 0.5 * desert + 0.75 * deck;
    float synoptic = 0.75 * wide.w + 0.75 * fronts.w + 0.4 * groups.w;
    float value = climate + synoptic + 0.38 * cells.w + 0.3 * tufts.w;
    float fine = 0.2 * groups.w + 0.12 * cells.w + 0.06 * tufts.w;
    value = mix(value, 0.25 * synoptic + 0.12 - 0.34 * on_land + fine, cumulus);
    value = mix(value, 0.2 * synoptic + 0.03 + fine, cold * (1.0 - polar));
    value = mix(value, 0.25 * synoptic + 0.22 + fine, decked);
    value += 0.45 * front + 0.6 * anvil.r + cover_shift;
    vec2 more = textureLod(amounts, uv, 0.0).rg;
    // Spread like the noise that will break it up: a texel is then no hole of its own shape in a deck,
    // as it would be beside a share that ends at 1.
    float cover = normal_share((value + more.r) / 0.133);

    // Optical thickness: 4 for trade-wind cumulus, 12 for decks, 70 in the cores of storms. Fronts and the
    // layers of high latitudes have even tops.
    float layered = clamp(front + polar + 0.5 * storms, 0.0, 1.0) * (1.0 - anvil.r);
    float lumpy = (0.7 * cells.w + 0.8 * tufts.w) * (1.0 - 0.7 * layered);
    float core = 0.7 * min(value, 0.8) + 0.6 * groups.w + lumpy;
    float thickness = clamp(3.0 * exp(0.6 * deck + 1.6 * core + 0.3 * storms + 0.4 * belt + 0.3 * polar
                                      + 0.7 * front + 0.3 * anvil.r + 1.2 * anvil.g + more.g), 1.0, 90.0);

    // Thin high cloud: blown out of towers and ahead of fronts, drawn out to the east.
    vec3 blown = vec3(local.xy, 3.0 * local.z) + 0.5 * (drawn - local);
    float streaks = noise_at(blown, 6000.0).w + 0.6 * noise_at(blown.zxy, 1800.0).w;
    float high = clamp(1.8 * (streaks + 0.4 * belt + 0.3 * storms + 0.3 * comma.b - 0.6) + 0.5 * anvil.r, 0.0, 1.0);

    // Over land cumulus grows in clumps, not in streets.
    float kind = mix(1.0, mix(2.0 / 3.0, 0.8, on_land), smoothstep(0.3, 0.4, cumulus));
    kind = mix(kind, 1.0 / 3.0, smoothstep(0.45, 0.55, cold));
    kind = mix(kind, 0.0, smoothstep(0.45, 0.55, decked));
    kind = mix(kind, 1.0, smoothstep(0.15, 0.25, deep));

    weather = vec4(cover, log(thickness) / LOG_THICKEST, high, kind);
}
