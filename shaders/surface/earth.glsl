#include "block/spacecraft"
#include "surface/material.glsl"

// What the spacecraft sees around it (simgl/environment_map.py), in axes of its own [W m-2 sr-1].
uniform sampler2D sky_cube;   // faces +x -x +y -y +z -z with borders, one below the other
// What glossy lobes of roughness 0.2, 0.4 ... 1 see of it: slices of octahedral maps by the lobe's
// axis.
uniform sampler3D sky_lobes;
// Irradiance of a plane by its normal, an octahedral map [W m-2].
uniform sampler2D sky_irradiance;

const float SKY_LOBES = 5.0;
// A smoother lobe is narrower than a texel of the cube.
const float SMOOTH = 0.05;

// Place of a direction on an octahedral map, -1..1 (Meyer et al. 2010).
vec2 octahedral(vec3 d) {
    vec2 p = d.xy / (abs(d.x) + abs(d.y) + abs(d.z));
    vec2 side = vec2(p.x < 0.0 ? -1.0 : 1.0, p.y < 0.0 ? -1.0 : 1.0);
    return d.z < 0.0 ? (1.0 - abs(p.yx)) * side : p;
}

// Texture coordinates there. The outermost of the map's `points` lie on the square's edges.
vec2 octahedral_place(vec3 d, float points) {
    return 0.5 + 0.5 * octahedral(d) * (1.0 - 1.0 / points);
}

// Radiance of the sky in a direction, linear between the texels of the cube.
vec4 mirrored_sky(vec3 d) {
    vec3 along = abs(d);
    float longest = max(along.x, max(along.y, along.z));
    // As of OpenGL's cube maps: right and down on the face.
    float face = d.x < 0.0 ? 1.0 : 0.0;
    vec2 place = vec2(d.x < 0.0 ? d.z : -d.z, -d.y);
    if (along.y == longest && along.x != longest) {
        face = d.y < 0.0 ? 3.0 : 2.0;
        place = vec2(d.x, d.y < 0.0 ? -d.z : d.z);
    } else if (along.x != longest) {
        face = d.z < 0.0 ? 5.0 : 4.0;
        place = vec2(d.z < 0.0 ? -d.x : d.x, -d.y);
    }
    vec2 size = vec2(textureSize(sky_cube, 0));
    vec2 texel = 0.5 * size.x + 0.5 * (size.x - 2.0) * place / longest;
    return textureLod(sky_cube, (vec2(0.0, face * size.x) + texel) / size, 0.0);
}

// Mean radiance of the sky that a round lobe of a roughness about a direction sees.
vec4 glossy_sky(vec3 d, float roughness) {
    const float smoothest = 1.0 / SKY_LOBES;
    vec2 place = octahedral_place(d, float(textureSize(sky_lobes, 0).x));
    // Below the first slice's roughness the texture repeats that slice.
    vec4 lobe = textureLod(sky_lobes, vec3(place, roughness - 0.5 * smoothest), 0.0);
    vec4 mirror = mirrored_sky(d);
    return mix(mirror, lobe, clamp((roughness - SMOOTH) / (smoothest - SMOOTH), 0.0, 1.0));
}

// What a lobe sees of the sky that it turns to the viewer; `seen` as of_lobe has it.
vec4 seen_sky(Surface s, mat3 to_sky, vec2 seen) {
    vec3 along = seen.x * (dot(s.n, s.wo) * s.n - s.wo);
    vec3 axis = along + sqrt(max(1.0 - dot(along, along), 0.0)) * s.n;
    return glossy_sky(to_sky * axis, seen.y);
}

// Radiance of the Earth's light that a surface turns to the viewer [W m-2 sr-1].
vec4 earth_light(Surface s, Albedo albedo) {
    mat3 to_sky = mat3(sky_from_camera);
#ifdef MOVING
    to_sky = mat3(to_sky * light_at(vec3(1.0, 0.0, 0.0), -s.time),
                  to_sky * light_at(vec3(0.0, 1.0, 0.0), -s.time),
                  to_sky * light_at(vec3(0.0, 0.0, 1.0), -s.time));
#endif
    vec2 place = octahedral_place(to_sky * s.n, float(textureSize(sky_irradiance, 0).x));
    vec4 light = s.earth_share * albedo.diffuse / PI * textureLod(sky_irradiance, place, 0.0);
    if (!s.lambertian)
        light += s.sky_share * albedo.glossy * seen_sky(s, to_sky, albedo.seen);
    // Points without a coat are mostly drawn with a shader that has none.
    if (s.coat > 0.0)
        light += s.coat_sky_share * albedo.coat * seen_sky(s, to_sky, albedo.coat_seen);
    return light;
}
