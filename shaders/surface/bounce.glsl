#include "surface/material.glsl"

// What the other surfaces of the spacecraft do to this one, solved per vertex for every frame
// (simgl/transport/solve.py).

#ifdef EXCHANGE
in vec4 bounced;        // irradiance from them, after all bounces [W m-2]
in float earth_share;   // what they leave of the Earth's irradiance
#ifdef TWO_SIDED
in vec4 bounced_back;   // the same behind the surface
in float earth_share_back;
#endif
#endif

// Share of the Earth's light that other surfaces do not hide.
float past_the_craft() {
#ifdef TWO_SIDED
    return gl_FrontFacing ? earth_share : earth_share_back;
#elif defined(EXCHANGE)
    return earth_share;
#else
    return 1.0;
#endif
}

#ifdef EXCHANGE
// Radiance of the light from other surfaces that this one turns to the viewer [W m-2 sr-1]. To the
// specular lobes it is uniform over the hemisphere.
vec4 bounced_light(Albedo albedo) {
#ifdef TWO_SIDED
    vec4 irradiance = gl_FrontFacing ? bounced : bounced_back;
#else
    vec4 irradiance = bounced;
#endif
    return (albedo.diffuse + albedo.glossy + albedo.coat) * irradiance / PI;
}
#endif
