// The medium by height. The profiles lie in a table that is even in the root of height, as in
// simgl/physics/air_profile.py.
#include "air/medium.glsl"
#include "air/places.glsl"

// Share of the column of molecules, aerosol and ozone in a kilometre of height.
uniform sampler2D air_profile;

#ifdef ABSORBERS
// What gases besides ozone absorb in a kilometre, per band.
uniform sampler2D air_absorption;
#endif

float profile_place(float height) {
    return table_place(sqrt(clamp(height / air_top, 0.0, 1.0)), float(textureSize(air_profile, 0).x));
}

vec3 densities_at(float height) {
    return textureLod(air_profile, vec2(profile_place(height), 0.5), 0.0).rgb;
}

// The refractive index in green, less 1.
float refractivity_at(float height) {
    return refraction * densities_at(height).x;
}

Medium medium_at(float height) {
    vec3 density = densities_at(height);
    vec4 rayleigh = rayleigh_scattering * density.x;
    vec4 extinction = rayleigh + aerosol_extinction * density.y + ozone_absorption * density.z;
#ifdef ABSORBERS
    extinction += textureLod(air_absorption, vec2(profile_place(height), 0.5), 0.0);
#endif
    return Medium(rayleigh, aerosol_scattering * density.y, extinction);
}
