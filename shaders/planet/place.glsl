// A place on the Earth as a pixel sees it, and the light there.
#include "block/planet"
#include "common/sun.glsl"
#include "air/daylight.glsl"
#ifdef AIR
#include "air/air.glsl"
#endif

// Light as it reaches the camera: dimmed by the air on the way.
//
// normal    : of the ellipsoid, ITRF
// view      : unit, towards the camera, ITRF
// on_map    : longitude and latitude, 0..1 eastwards and southwards
// footprint : of the pixel [rad of latitude]
// lit       : effective cosine of the Sun's disc
// direct    : irradiance by the Sun on a plane that faces it, at the ground [W m-2]
// diffuse   : irradiance by the sky on the horizontal ground [W m-2]
// to_ground : transmittance from the ground to the camera
// white     : radiance of a white layer at the height of the clouds [W m-2 sr-1]
// beneath   : radiance that the air between ground and clouds adds [W m-2 sr-1]
struct Place {
    vec3 normal;
    vec3 view;
    vec2 on_map;
    float footprint;
    float lit;
    vec4 direct;
    vec4 diffuse;
    vec4 to_ground;
    vec4 white;
    vec4 beneath;
};

// Where a ray along `d` meets the ground at `t`, in sphere space; the cosine there, at least 1e-3.
Place place_at(vec3 d, float t, float slant) {
    Place place;
    // The gradient of the sphere's equation, stretched back, is the ellipsoid's normal (ITRF).
    place.normal = normalize((camera_in_sphere.xyz + t * d) * sphere_axes.xyz);
    place.view = -normalize(d / sphere_axes.xyz);
    place.footprint = t / (intrinsics.x * sqrt(slant));
    float mu_sun = dot(place.normal, sun_direction_itrf.xyz);
    place.lit = disc_cosine(mu_sun, sun_angular_radius);
    Daylight day = air_daylight(mu_sun);
    place.direct = day.direct;
    place.diffuse = day.diffuse;
    place.to_ground = vec4(1.0);
#ifdef EARTH_MAPS
    vec3 n = place.normal;
    place.on_map = vec2(atan(n.y, n.x) / (2.0 * PI) + 0.5,
                        0.5 - atan(n.z, max(length(n.xy), 1e-4)) / PI);
    Daylight high = air_daylight_at(cloud_km, mu_sun);
    place.white = (high.direct * place.lit + high.diffuse) / PI;
    place.beneath = vec4(0.0);
#endif
    return place;
}

#ifdef AIR
Place place_through(AirRay air, Place place) {
    place.to_ground = air.to_ground;
    place.direct *= air.to_ground;
    place.diffuse *= air.to_ground;
#ifdef EARTH_MAPS
    AirRay over = air_before(air, cloud_km);
    place.white *= over.to_ground;
    place.beneath = air.light - over.light;
#endif
    return place;
}
#endif
