// Earth and air behind the spacecraft, radiance [W m-2 sr-1], a mean over the pixel at the limb, and
// the share of what lies beyond that is seen past them.
#if defined(EARTH_MAPS) && !defined(AIR_INSIDE)
#define TOWERS
#endif
#include "block/planet"
#include "common/coverage.glsl"
#include "planet/ground.glsl"
#include "planet/ray.glsl"
#ifdef TOWERS
#include "planet/towers.glsl"
#endif

layout(location = 0, index = 0) out vec4 radiance;
layout(location = 0, index = 1) out vec4 beyond;

void main() {
    Ray ray = ray_through(gl_FragCoord.xy);
    vec3 d = ray.d;
    float dd = ray.dd, od = ray.od, discriminant = ray.discriminant;
    float on_earth = od < 0.0 ? coverage(discriminant) : 0.0;
#ifdef AIR
    float stretch = sqrt(dd);
    AirRay air = air_ray(d / stretch, od / stretch, discriminant / dd, on_earth);
    radiance = air.light;
    beyond = air.to_space * (1.0 - on_earth);
#else
    radiance = vec4(0.0);
    beyond = vec4(1.0 - on_earth);
#endif
    float on_clouds = on_earth;
#ifdef EARTH_MAPS
    // Clouds stand over the horizon.
    float to_clouds = clouds_discriminant(ray);
    if (clouds_below > 0.0 && od < 0.0) on_clouds = max(coverage(to_clouds), on_earth);
    float cloud_t = clouds_t(ray, to_clouds);
#ifdef TOWERS
    layer_km = cloud_km;
    Tower tower = tower_before(ray, clouds_below > 0.0 && od < 0.0 && on_clouds < 1.0);
    if (tower.covers > on_clouds) {
        on_clouds = tower.covers;
        cloud_t = tower.t;
        layer_km = tower.height;
        layer_mu = max(-(od + tower.t * dd) * inversesqrt(dd), 0.0);
    }
#endif
#else
    float cloud_t = clouds_t(ray, discriminant);
#endif
    if (on_clouds <= 0.0) return;
    float root = covered_root(discriminant);
    float t = outside / (root - od);
    Place here = place_at(d, t, cloud_t, max(root / sqrt(dd), 1e-3));
#ifdef AIR
    here = place_through(air, here);
#endif
#if defined(EARTH_MAPS) && !defined(SEA)
    here = with_land_around(here);
#endif
    Sight sight = ground_sight(here, on_earth, on_clouds);
    radiance += sight.light;
    beyond *= sight.transmittance;
}
