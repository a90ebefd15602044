// Clouds as one thin layer: what they reflect, and how noise breaks them up.

// Of the optical thickness of code 1; code 0 is 1.
const float LOG_THICKEST = 4.6051702;

// Droplets scatter forward: asymmetry 0.85, scaled after Joseph, Wiscombe and Weinman (1976).
const float DROPLET_G = 0.85;
const float SCALED_TAU = 1.0 - DROPLET_G * DROPLET_G;
const float SCALED_G = DROPLET_G / (1.0 + DROPLET_G);

// Mean cosine of the Sun's light on the facets of a rough top that it reaches, within 0.02 of that by normally
// distributed slopes of mean square 0.35 (tools/cloud_reflection.py): a low Sun lights steep faces.
float cosine_on_tops(float mu) {
    return 0.4 + 0.46 * max(mu, 0.0);
}

// Directional-hemispherical reflectance of a cloud that absorbs nothing, by the two-stream method in
// Eddington's form (Meador and Weaver 1980, eq. 24). tau: optical thickness; mu: cosine of the light.
float cloud_reflectance(float tau, float mu) {
    float scaled = SCALED_TAU * tau;
    float g1 = 0.75 * (1.0 - SCALED_G);
    float g3 = 0.5 - 0.75 * SCALED_G * mu;
    return (g1 * scaled + (g3 - g1 * mu) * (1.0 - exp(-scaled / mu))) * (1.0 / (1.0 + g1 * scaled));
}

// The same for light from all sides: the two-stream limit.
float cloud_diffuse_reflectance(float tau) {
    float scaled = SCALED_TAU * tau;
    float g1 = 0.75 * (1.0 - SCALED_G);
    return g1 * scaled * (1.0 / (1.0 + g1 * scaled));
}

// Share of a standard normal variable below x, within 2e-4 (Page 1977).
float normal_share(float x) {
    return 1.0 / (1.0 + exp(-x * (1.5976 + 0.07056 * x * x)));
}

// Its inverse, within 0.012 for shares from 0.002 to 0.998.
float normal_quantile(float share) {
    float x = clamp(share, 0.002, 0.998);
    float odds = log(x / (1.0 - x));
    return odds * (0.3544 + 7.2377 / (26.732 + odds * odds));
}

// How soft a cloud's edge is, by its kinds' shares: the noise's rms over which it grows from nothing to its thickness.
float cloud_softness(vec4 shares) {
    return dot(shares, vec4(0.5, 0.3, 0.2, 0.3));
}

// How noise breaks up cloud of which `share` of the surroundings is full.
//
// Cloud stands where noise exceeds a level. Of the noise, spread like a standard normal variable, a
// pixel resolves `seen`, whose variance is `resolved`; the rest is a chance. So the mean over the noise is
// `share` whatever is resolved: no pixel is too large, and none shows grains that are finer than itself.
//
// level, steepness : the cover is that share of a normal variable which lies below level + steepness * seen
// largest : of the cover
// mean : of the noise that is seen within the cloud, weighted by the cover
struct Broken {
    float level;
    float steepness;
    float largest;
    float mean;
};

Broken broken_up(float share, float resolved, float softness) {
    float x = clamp(share, 0.002, 0.998), quantile = normal_quantile(x);
    float soft2 = softness * softness, spread = sqrt(1.0 + soft2);
    Broken cloud;
    cloud.steepness = inversesqrt(1.0 - resolved + soft2);
    cloud.level = quantile * spread * cloud.steepness;
    // No cloud of the clamped quantile where there is none: a share is at least a code of the map.
    cloud.largest = min(255.0 * share, 1.0);
    cloud.mean = resolved * 0.39894 * exp(-0.5 * quantile * quantile) / (x * spread);
    return cloud;
}

// Part of a pixel that cloud covers.
float cloud_cover(Broken cloud, float seen) {
    return normal_share(cloud.level + cloud.steepness * seen) * cloud.largest;
}

// Of values at the codes 0, 1/3, 2/3 and 1, the one at a code.
//
// first_and_rises : the first value, and by how much each of the others is higher than the one before
float cloud_shape(vec4 first_and_rises, float code) {
    return first_and_rises.x + dot(first_and_rises.yzw, clamp(3.0 * code - vec3(0.0, 1.0, 2.0), 0.0, 1.0));
}

// How far clouds stand above the layer, by share and code of the thickness: from a thickness of 13 on, and 1 at
// 60, the cores of storms.
float tower_height(vec2 share_and_code) {
    return share_and_code.x * smoothstep(0.55, 0.89, share_and_code.y);
}

float cloud_thickness(float code) {
    return exp(code * LOG_THICKEST);
}
