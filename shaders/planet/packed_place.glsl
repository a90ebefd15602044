// A place and the light there as tiles.vert hands it to tiles.frag: in vectors of four, since every member, a
// single number too, takes one of the 31 outputs that drivers have.
struct PackedPlace {
    vec4 normal_lit;
    vec4 view_footprint;
    PlaceLight light;
#ifdef EARTH_MAPS
#ifdef ONE_FACE
    vec4 ground;
    vec4 cloud;
    vec4 shade;
    vec4 fibres;        // of ground and cloud
    vec4 fibres_turn;   // of shade
#elif defined(TWO_FACES)
    vec4 ground_nearness;
    vec4 cloud_nearness;
    vec4 shade_nearness;
    vec4 ground_charts;
    vec4 cloud_charts;
    vec4 shade_charts;
    vec4 ground_fibres;
    vec4 cloud_fibres;
    vec4 shade_fibres;
#else
    vec4 on_map;        // ground and cloud
    vec2 shade_on_map;
    vec3 ground_up;
    vec3 cloud_up;
    vec3 shade_up;
#endif
    vec4 wind_bed_level_sun;
    vec4 fray_levels;
    vec4 resolved_slope;
    vec4 resolved_clouds;
#endif
};

#ifdef TILE_CORNERS
PackedPlace in_parts(Place place) {
    PackedPlace parts;
    parts.normal_lit = vec4(place.normal, place.lit);
    parts.view_footprint = vec4(place.view, place.footprint);
    parts.light = place.light;
#ifdef EARTH_MAPS
#ifdef ONE_FACE
    parts.ground = vec4(place.ground.on_map, place.ground.on_chart);
    parts.cloud = vec4(place.cloud.on_map, place.cloud.on_chart);
    parts.shade = vec4(place.shade.on_map, place.shade.on_chart);
    parts.fibres = vec4(place.ground.along_fibres, place.cloud.along_fibres);
    parts.fibres_turn = vec4(place.shade.along_fibres, place.turn);
#elif defined(TWO_FACES)
    parts.ground_nearness = vec4(place.ground.on_map, place.ground.nearness);
    parts.cloud_nearness = vec4(place.cloud.on_map, place.cloud.nearness);
    parts.shade_nearness = vec4(place.shade.on_map, place.shade.nearness);
    parts.ground_charts = place.ground.on_charts;
    parts.cloud_charts = place.cloud.on_charts;
    parts.shade_charts = place.shade.on_charts;
    parts.ground_fibres = place.ground.along_fibres;
    parts.cloud_fibres = place.cloud.along_fibres;
    parts.shade_fibres = place.shade.along_fibres;
#else
    parts.on_map = vec4(place.ground.on_map, place.cloud.on_map);
    parts.shade_on_map = place.shade.on_map;
    parts.ground_up = place.ground.up;
    parts.cloud_up = place.cloud.up;
    parts.shade_up = place.shade.up;
#endif
    parts.wind_bed_level_sun = vec4(place.wind, place.bed_steepness, place.level_sun);
    parts.fray_levels = vec4(place.fray, place.levels);
    parts.resolved_slope = vec4(place.resolved, 0.0, 0.0);
#ifdef RELIEF_AT_CORNERS
    parts.resolved_slope.zw = place.slope;
#endif
    parts.resolved_clouds = place.resolved_clouds;
#endif
    return parts;
}
#else
Place in_full(PackedPlace parts) {
    Place place;
    place.normal = parts.normal_lit.xyz;
    place.lit = parts.normal_lit.w;
    place.view = parts.view_footprint.xyz;
    place.footprint = parts.view_footprint.w;
    place.light = parts.light;
#ifdef EARTH_MAPS
#ifdef ONE_FACE
    place.ground = Spot(parts.ground.xy, parts.ground.zw, parts.fibres.xy);
    place.cloud = Spot(parts.cloud.xy, parts.cloud.zw, parts.fibres.zw);
    place.shade = Spot(parts.shade.xy, parts.shade.zw, parts.fibres_turn.xy);
    place.turn = parts.fibres_turn.zw;
#else
#ifdef TWO_FACES
    place.ground = Spot(parts.ground_nearness.xy, parts.ground_charts, parts.ground_fibres, parts.ground_nearness.zw);
    place.cloud = Spot(parts.cloud_nearness.xy, parts.cloud_charts, parts.cloud_fibres, parts.cloud_nearness.zw);
    place.shade = Spot(parts.shade_nearness.xy, parts.shade_charts, parts.shade_fibres, parts.shade_nearness.zw);
#else
    place.ground = Spot(parts.on_map.xy, parts.ground_up);
    place.cloud = Spot(parts.on_map.zw, parts.cloud_up);
    place.shade = Spot(parts.shade_on_map, parts.shade_up);
#endif
    place.turn = turn_at(place.normal);
#endif
    place.mu_sun = dot(place.normal, sun_direction_itrf.xyz);
    place.wind = parts.wind_bed_level_sun.x;
    place.bed_steepness = parts.wind_bed_level_sun.y;
    place.level_sun = parts.wind_bed_level_sun.zw;
    place.fray = parts.fray_levels.xy;
    place.levels = parts.fray_levels.zw;
    place.resolved = parts.resolved_slope.xy;
#ifdef RELIEF_AT_CORNERS
    place.slope = parts.resolved_slope.zw;
#endif
    place.resolved_clouds = parts.resolved_clouds;
#endif
    return place;
}
#endif
