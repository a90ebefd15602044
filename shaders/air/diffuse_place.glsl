// Where the tables of diffuse light keep a height and a cosine of the Sun's angle: texels crowd at the
// ground and about the terminator.
#include "block/air"
#include "air/places.glsl"

const float SUN_CROWDING = 16.0, SUN_MIDDLE = 0.04;

float arcsinh(float x) {
    return sign(x) * log(abs(x) + sqrt(x * x + 1.0));
}

vec2 diffuse_place(float height, float mu_sun, vec2 size) {
    float low = arcsinh(SUN_CROWDING * (SUN_MIDDLE - 1.0));
    float high = arcsinh(SUN_CROWDING * (SUN_MIDDLE + 1.0));
    float x = (arcsinh(SUN_CROWDING * (SUN_MIDDLE + mu_sun)) - low) / (high - low);
    float y = sqrt(clamp(height / air_top, 0.0, 1.0));
    return vec2(table_place(x, size.x), table_place(y, size.y));
}

// Height and cosine of the Sun's angle of a texel.
vec2 diffuse_texel(vec2 centre, vec2 size) {
    float low = arcsinh(SUN_CROWDING * (SUN_MIDDLE - 1.0));
    float high = arcsinh(SUN_CROWDING * (SUN_MIDDLE + 1.0));
    float x = mix(low, high, table_value(centre.x, size.x));
    float y = table_value(centre.y, size.y);
    float mu_sun = 0.5 * (exp(x) - exp(-x)) / SUN_CROWDING - SUN_MIDDLE;
    return vec2(air_top * y * y, clamp(mu_sun, -1.0, 1.0));
}
