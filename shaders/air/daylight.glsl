// What shines on a place on the ground, or above it.
//
// direct  : of the Sun on a plane that faces it, through the air, past no horizon: the plane's cosine
//           (disc_cosine of the angle to its normal) brings in what the horizon hides
// diffuse : of the sky on a horizontal plane that faces up; 0 without air
//
// Irradiances [W m-2], for the sunlight of the block Planet.
#include "block/planet"
#ifdef AIR
#include "air/transmittance.glsl"
#include "air/diffuse_place.glsl"
uniform sampler2D diffuse_down;
#endif

struct Daylight {
    vec4 direct;
    vec4 diffuse;
};

// height : above the ground [km]; mu_sun : cosine of the Sun's direction from the vertical there
Daylight air_daylight_at(float height, float mu_sun) {
#ifdef AIR
    vec2 place = diffuse_place(height, mu_sun, vec2(textureSize(diffuse_down, 0)));
    return Daylight(earth_sun_irradiance * transmittance_to_space(height, mu_sun),
                    earth_sun_irradiance * textureLod(diffuse_down, place, 0.0));
#else
    return Daylight(earth_sun_irradiance, vec4(0.0));
#endif
}

Daylight air_daylight(float mu_sun) {
    return air_daylight_at(0.0, mu_sun);
}
