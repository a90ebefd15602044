// Light that was scattered or reflected at least once, by height and the Sun's angle; what the tables
// hold is said at Skylight in simgl/physics/skylight.py.
#include "air/medium.glsl"
#include "air/diffuse_place.glsl"

uniform sampler2D diffuse_mean;
uniform sampler2D diffuse_mxx;
uniform sampler2D diffuse_mzz;
uniform sampler2D diffuse_mxz;
uniform sampler2D diffuse_aureole;
uniform sampler3D diffuse_by_look;
uniform sampler3D diffuse_by_look_x;

// What the medium's two scatterers turn of this light into the way against a view direction, as a share
// of what a kilometre of each scatters [sr-1].
struct DiffuseLight {
    vec4 by_rayleigh;
    vec4 by_aerosol;
};

// At a height, against a view direction at `mu` from the zenith and `nu` from the Sun.
DiffuseLight diffuse_light(float height, float mu, float mu_sun, float nu) {
    vec2 place = diffuse_place(height, mu_sun, vec2(textureSize(diffuse_mean, 0)));
    vec3 look = vec3(place.x, table_place(0.5 + 0.5 * mu, float(textureSize(diffuse_by_look, 0).y)),
                     place.y);
    vec4 mean = textureLod(diffuse_mean, place, 0.0), mxx = textureLod(diffuse_mxx, place, 0.0);
    vec4 mzz = textureLod(diffuse_mzz, place, 0.0), mxz = textureLod(diffuse_mxz, place, 0.0);
    float x = (nu - mu * mu_sun) * inversesqrt(max(1.0 - mu_sun * mu_sun, 1e-6));
    float y2 = max(1.0 - x * x - mu * mu, 0.0);
    vec4 myy = mean - mxx - mzz;
    vec4 along = x * x * mxx + y2 * myy + mu * mu * mzz + 2.0 * x * mu * mxz;
    // Henyey and Greenstein's function convolved with itself has the square of its asymmetry.
    vec4 aureole = textureLod(diffuse_aureole, place, 0.0);
    vec4 gg = aerosol_asymmetry * aerosol_asymmetry;
    vec4 e = 1.0 + gg * gg - 2.0 * gg * nu;
    // Twice around the zenith, the field's second Legendre term, less the aureole's own.
    vec4 twice = 3.75 * gg * (x * x - y2) * (mxx - myy - aureole * gg * (1.0 - mu_sun * mu_sun));
    vec4 by_aerosol = (aureole * (1.0 - gg * gg) / (e * sqrt(e)) + twice) / (4.0 * PI)
                    + textureLod(diffuse_by_look, look, 0.0)
                    + textureLod(diffuse_by_look_x, look, 0.0) * x;
    vec4 by_rayleigh = 3.0 / (16.0 * PI) * (rayleigh_shape.x * mean + rayleigh_shape.y * along);
    return DiffuseLight(by_rayleigh, by_aerosol);
}
