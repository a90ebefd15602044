// Clouds over the camera's head: what they send down, and the share of all behind that they let pass.
#include "block/planet"
#include "common/coverage.glsl"
#include "planet/cloud.glsl"
#include "planet/place.glsl"
#include "planet/ray.glsl"

uniform sampler2D weather_map;

layout(location = 0, index = 0) out vec4 radiance;
layout(location = 0, index = 1) out vec4 beyond;

// Radiance below a layer [W m-2 sr-1], and what passes it unscattered.
//
// Light goes through by two streams; what droplets only throw forward stays near the Sun, about which
// it is spread by Henyey and Greenstein's law.
//
// mu, nu : cosines of the view from the vertical, and from the Sun
struct Layer {
    vec4 light;
    float past;
};

Layer from_below(float tau, Daylight above, float lit, float mu_sun, float mu, float nu) {
    float mu_light = max(mu_sun, 0.05);
    float forward = exp(-SCALED_TAU * tau / mu_light);
    float through = 1.0 - cloud_reflectance(tau, mu_light) - forward;
    float diffuse_through = 1.0 - cloud_diffuse_reflectance(tau);
    float g2 = DROPLET_G * DROPLET_G, e = 1.0 + g2 - 2.0 * DROPLET_G * nu;
    float aureole = (1.0 - g2) / (4.0 * PI * e * sqrt(e));
    float thrown = forward * (1.0 - exp(-(1.0 - SCALED_TAU) * tau / mu_light)) * aureole;
    float past = exp(-tau / max(mu, 0.02));
    vec4 light = above.direct * lit * (max(through, 0.0) / PI)
               + above.direct * step(0.0, mu_sun) * thrown
               + above.diffuse * (diffuse_through / PI);
    // What of it the layer sends; the clear sky behind it comes by `past`.
    return Layer(light * (1.0 - past), past);
}

void main() {
    Ray ray = ray_through(gl_FragCoord.xy);
    vec3 d = ray.d, sun = sun_direction_itrf.xyz;
    float stretch = sqrt(ray.dd);
    float on_earth = ray.od < 0.0 ? coverage(ray.discriminant) : 0.0;
    float t = clouds_t(ray, clouds_discriminant(ray));
    vec3 n = normalize((camera_in_sphere.xyz + t * d) * sphere_axes.xyz);
    vec3 view = normalize(d / sphere_axes.xyz);
    float mu = max(dot(n, view), 0.02), mu_sun = dot(n, sun), nu = dot(view, sun);

    float footprint = planet_km * t / (intrinsics.x * sqrt(mu));
    vec2 texels = footprint * stretch / vec2(map_texel_km, chart_texel_km);
    vec2 levels = log2(texels);
    levels.y = chart_level(max(levels.y, 0.0));
    float resolved_fibres = chart_variance[int(levels.y)].y;
    Spot spot = spot_at(n, place_on_map(n));
    vec4 weather = textureLod(weather_map, spot.on_map, levels.x - weather_halvings);
    vec4 kinds = cloud_kinds(weather.w);
    float noise = clouds_noise(spot, levels.y, kinds);
    vec4 shares = kinds * kinds;
    Broken cloud = broken_up(weather.x, dot(shares, cloud_variance[int(levels.y)]), cloud_softness(shares));
    float cover = cloud_cover(cloud, noise);
    float thick = max(1.0 + 0.5 * (noise - cloud.mean), 0.2);
    float high_tau = high_cloud_thickness * weather.z * fibres(spot, levels.y, resolved_fibres);

    Daylight above = air_daylight_at(cloud_km, mu_sun);
#ifdef NIGHT
    above.diffuse += glow_irradiance * nightfall(mu_sun);
#endif
    float lit = disc_cosine(mu_sun, sun_angular_radius);
    // Thin high cloud is lit by as much as the layer.
    Layer low = from_below(cloud_thickness(weather.y) * thick, above, lit, mu_sun, mu, nu);
    Layer high = from_below(high_tau, above, lit, mu_sun, mu, nu);
    float past_low = 1.0 - cover * (1.0 - low.past);
    float past = past_low * high.past;
    vec4 light = cover * low.light + past_low * high.light;
#ifdef AIR
    AirRay air = air_ray(d / stretch, ray.od / stretch, ray.discriminant / ray.dd, on_earth);
    AirRay over = air_before(air, cloud_km);
    if (air.mu_camera <= 0.0) over = AirRay(air.light, air.to_space, air.to_space, 0.0, 0.0);
    light = light * over.to_ground + over.light * (1.0 - past);
#endif
    radiance = light * (1.0 - on_earth);
    beyond = vec4(mix(past, 1.0, on_earth));
}
