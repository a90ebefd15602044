// Towers of storms that stand over the horizon.
#include "planet/ray.glsl"

// Places at which a ray that passes over the layer of clouds is looked at for a tower, from where the highest
// ones reach up to it to where it comes nearest to the ground. What stands farther is behind the most air.
const int TOWER_LOOKS = 6;

// covers : part of the pixel
// t      : where the ray meets it
// height : there [km]
struct Tower {
    float covers;
    float t;
    float height;
};

// wanted : of the ray; where no ray of a block is wanted, software renderers leave out most of the work
Tower tower_before(Ray ray, bool wanted) {
    float nearest = -ray.od / ray.dd;
    float lowest = -0.5 * planet_km * ray.discriminant / ray.dd;
    float rises = cloud_km + tower_km - lowest;
    Tower tower = Tower(0.0, nearest, lowest);
    int looks = wanted && tower_km > 0.0 && rises > 0.0 ? TOWER_LOOKS : 0;
    float reach = sqrt(2.0 * max(rises, 0.0) / (planet_km * ray.dd));
    float pixel_km = planet_km * nearest / intrinsics.x;
    float level = log2(pixel_km / map_texel_km) - weather_halvings;
    for (int k = 1; k <= looks && tower.covers < 1.0; ++k) {
        float way = 1.0 - float(k) / float(TOWER_LOOKS), t = nearest - way * reach;
        vec3 n = normalize((camera_in_sphere.xyz + t * ray.d) * sphere_axes.xyz);
        vec2 weather = textureLod(weather_map, place_on_map(n), level).xy;
        float height = lowest + rises * way * way;
        float above = cloud_km + tower_km * tower_height(weather) - height;
        float covers = clamp(0.5 + above / pixel_km, 0.0, 1.0);
        if (above > 0.0 && covers > tower.covers) tower = Tower(covers, t, height);
    }
    return tower;
}
