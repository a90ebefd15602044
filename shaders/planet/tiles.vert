// Corners of tiles that lie on the ground and see it change evenly: what planet.frag finds for every
// pixel, found here.
#include "planet/ground.glsl"
#include "planet/ray.glsl"
#define TILE_CORNERS
#include "planet/packed_place.glsl"
#include "planet/sea_at_corners.glsl"
#include "common/tile_corner.glsl"

noperspective out PackedPlace parts;
noperspective out vec4 light;
#ifdef SEA_IS_EVEN
noperspective out Sea sea;
#endif

void main() {
    vec2 pixel = area.xy + tile_corner();
    gl_Position = vec4(pixel * area.zw - 1.0, 0.0, 1.0);
    Ray ray = ray_through(pixel);
    float discriminant = max(ray.discriminant, 0.0);
    float root = sqrt(discriminant), stretch = sqrt(ray.dd);
    float cloud_t = clouds_t(ray, clouds_discriminant(ray));
    Place place = place_at(ray.d, outside / (root - ray.od), cloud_t, max(root / stretch, 1e-3));
    AirRay air = air_ray(ray.d / stretch, ray.od / stretch, discriminant / ray.dd, 1.0);
    place = place_through(air, place);
#ifndef SEA
    place = with_land_around(place);
#endif
    light = air.light;
#ifdef RELIEF_AT_CORNERS
    place.slope = mapped_slope(textureLod(form_map, place.ground.on_map, place.levels.x - map_halvings.y).rg);
#endif
#ifdef SEA_IS_EVEN
    sea = sea_at(place);
#endif
    parts = in_parts(place);
}
