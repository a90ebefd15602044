// What a thermal camera sees of a spacecraft's shading points: band radiance as in thermal/planck.glsl;
// the temperature [K] and 1, which the resolve pass averages over a pixel with the covered share.
#include "block/spacecraft"
#include "thermal/planck.glsl"

uniform sampler2D gbuffer_position;
uniform sampler2D gbuffer_normal_roughness;
// Temperature [K], hemispherical emissivity, and the radiance that is reflected, in both units.
uniform sampler2D gbuffer_indirect;

out vec4 seen;

// A surface below this emissivity is metal, whose emission does not fall off towards grazing.
const float METAL = 0.3;

// Emissivity towards a direction: of a dielectric as Fresnel's term of Schlick (1994) leaves it, whose
// hemispherical mean is 20 / 21 of that along the normal.
float emissivity_towards(float hemispherical, float cosine) {
    if (hemispherical < METAL) return hemispherical;
    float off = 1.0 - clamp(cosine, 0.0, 1.0), off2 = off * off;
    return min(1.05 * hemispherical * (1.0 - off2 * off2 * off), 1.0);
}

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec3 place = (camera_from_body * vec4(texelFetch(gbuffer_position, at, 0).xyz, 1.0)).xyz;
    vec3 n = normalize(texelFetch(gbuffer_normal_roughness, at, 0).xyz);
    vec4 surface = texelFetch(gbuffer_indirect, at, 0);
    float emissivity = emissivity_towards(surface.y, abs(dot(n, normalize(place))));
    seen = vec4(emissivity * black_body(surface.x) + (1.0 - emissivity) * surface.zw, surface.x, 1.0);
}
