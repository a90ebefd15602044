// Earth and Sun behind the spacecraft, radiance [W m-2 sr-1], a mean over the pixel at the limbs.
#include "block/planet"
#include "common/sun.glsl"

uniform sampler2D day_map_rgb;   // sqrt of the reflectance, 0..1
uniform sampler2D day_map_nir;

out vec4 radiance;

// Unit direction of a pixel in camera axes.
vec3 pixel_ray(vec2 pixel) {
    return normalize(vec3((pixel - intrinsics.zw) / intrinsics.xy, 1.0));
}

// Part of the pixel on the positive side of a level line, from a value that vanishes on the line.
float coverage(float value) {
    float gradient = length(vec2(dFdx(value), dFdy(value)));
    return clamp(0.5 + value / max(gradient, 1e-30), 0.0, 1.0);
}

// Radiance of the Sun's disc where the ray passes `off` [rad] from its centre; 0 outside.
vec4 sun_disc(float off) {
    float width = length(vec2(dFdx(off), dFdy(off)));
    float seen = coverage(sun_angular_radius - off);
    // The pixel's part that lies on the disc.
    float near = clamp((off - 0.5 * width) / sun_angular_radius, -1.0, 0.999);
    float far = min((off + 0.5 * width) / sun_angular_radius, 1.0);
    return sun_radiance * limb_mean(near, far, sun_limb_u, sun_limb_v) * seen;
}

// Reflectance at geodetic latitude and longitude [rad]; `footprint` of the pixel [rad of latitude].
vec4 surface_reflectance(float latitude, float longitude, float footprint) {
    if (albedo_from_map < 0.5) return earth_albedo;
    vec2 place = vec2(longitude / (2.0 * PI) + 0.5, 0.5 - latitude / PI);
    float texels = footprint / PI * float(textureSize(day_map_rgb, 0).y);
    float level = log2(max(texels, 1e-6));
    vec4 root = vec4(textureLod(day_map_rgb, place, level).rgb,
                     textureLod(day_map_nir, place, level).r);
    return root * root;
}

void main() {
    vec3 ray = pixel_ray(gl_FragCoord.xy);
    float off_sun = atan(length(cross(ray, sun_direction.xyz)), dot(ray, sun_direction.xyz));
    vec4 sky = sun_disc(off_sun);

    // In sphere space |o + t d| = 1: t^2 dd + 2 t od + (oo - 1) = 0, oo - 1 taken in float64 outside.
    vec3 o = camera_in_sphere.xyz;
    vec3 d = mat3(sphere_from_camera) * ray;
    float dd = dot(d, d), od = dot(o, d);
    float discriminant = od * od - dd * outside;
    float on_earth = has_earth > 0.5 ? coverage(discriminant) : 0.0;
    if (on_earth <= 0.0 || od >= 0.0) {
        radiance = sky;
        return;
    }
    float root = sqrt(max(discriminant, 0.0));
    float t = outside / (root - od);
    vec3 ground = o + t * d;
    // The gradient of the sphere's equation, stretched back, is the ellipsoid's normal (ITRF).
    vec3 normal = normalize(ground * sphere_axes.xyz);
    float cosine = dot(normal, sun_direction_itrf.xyz);
    float slant = max(root / sqrt(dd), 1e-3);
    float footprint = t / (intrinsics.x * sqrt(slant));
    vec4 rho = surface_reflectance(asin(clamp(normal.z, -1.0, 1.0)),
                                   atan(normal.y, normal.x), footprint);
    vec4 earth = rho / PI * earth_sun_irradiance * disc_cosine(cosine, sun_angular_radius);
    radiance = mix(sky, earth, on_earth);
}
