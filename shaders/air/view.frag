// The air before one camera, for every direction: columns by azimuth from the Sun's vertical plane,
// rows by the place on the ground, the lowest height of the ray, or the elevation.
//
// TRANSMITTANCE: what it lets pass, and not its light.
#ifdef TRANSMITTANCE
#define WITHOUT_SUN
#define WITHOUT_DIFFUSE
#endif
#include "air/march.glsl"
#include "air/view.glsl"

// The fourth root of the light, or the eighth of the transmittance. SUMMED: what its terms add to the
// bands, of which air/root.frag takes the root.
out vec4 root;

// A ray bends about the Earth and comes lower than the straight one, whose d is given: d of the
// straight ray from a camera at `r` that comes as low. n r stays the same along a level ray; what
// would graze the ground or meet it stays as low as the ground.
float straight_as_low(float d, float r) {
    float seen = -d / (ground_radius + sqrt(ground_radius * ground_radius - d));
    float at_camera = refractivity_at(r - ground_radius);
    float height = seen;
    for (int i = 0; i < 5; ++i) {
        float lowest = refractivity_at(height);
        height = max(seen - (ground_radius + seen) * (lowest - at_camera) / (1.0 + lowest), 0.0);
    }
    return d + (seen - height) * (2.0 * ground_radius + seen + height);
}

void main() {
    float across = table_value(gl_FragCoord.x, view_columns);
    float cos_azimuth = 1.0 - 2.0 * across * across;
    float row = gl_FragCoord.y - 0.5 + first_row;
    float R2 = ground_radius * ground_radius;
    float c = outside_air * R2, r = sqrt(R2 + c);
    float b, d, lift = 0.0;
    bool ground = row < GROUND_ROWS - 0.5;
    if (ground) {
        d = d_of_row(row) * R2;
        b = -sqrt(c + d);
    } else if (row < GROUND_ROWS + LIMB_ROWS - 0.5) {
        d = straight_as_low(d_of_row(row) * R2, r);
        // At the top of the air, and at a camera's own level inside it, without a remainder.
        b = -sqrt(max(c + d, 0.0));
    } else {
        float x = (row - GROUND_ROWS - LIMB_ROWS) / (SKY_ROWS - 1.0);
        b = r * cosine_of_row(x);
        d = 0.0;
    }
    float mu = b / r;
    float sine = row < GROUND_ROWS + LIMB_ROWS - 0.5 ? sqrt(R2 - d) / r : sqrt(max(1.0 - mu * mu, 0.0));
    float nu = mu * camera_sun.x + sine * camera_sun.y * cos_azimuth;
    Stretch way = stretch_of_ray(c, r, b, d, camera_sun.x, nu, ground);
    Passage air = march(way, STEPS);
    // As roots, which bend less between rows: deep in the limb both fall by e within a kilometre.
    // Deep in the night the moments of the diffuse light may undershoot zero.
#ifdef SUMMED
#ifdef TRANSMITTANCE
    root = band_shares * air.transmittance;
#else
    root = band_shares * max(air.light, 0.0);
#endif
#elif defined(TRANSMITTANCE)
    root = sqrt(sqrt(sqrt(air.transmittance)));
#else
    root = sqrt(sqrt(max(air.light, 0.0)));
#endif
}
