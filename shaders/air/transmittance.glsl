// Transmittance of the air from a place to space, along straight rays that miss the ground.
//
// The table's axes after Bruneton & Neyret (2008): the length of the ray between its least and its
// greatest for this height, and the distance to the horizon. Both crowd texels where the horizon is.
#include "air/medium.glsl"
#include "air/places.glsl"

uniform sampler2D transmittance_table;

// Of a place at `height` and a direction `mu` from its zenith.
vec2 transmittance_place(float height, float mu) {
    vec2 size = vec2(textureSize(transmittance_table, 0));
    float top = above_ground(air_top), here = above_ground(height);
    float b = (ground_radius + height) * mu;
    float above = top - here;
    // -b + sqrt(b^2 + above) in the form that does not cancel.
    float root = sqrt(b * b + above);
    float way = b > 0.0 ? above / (b + root) : root - b;
    float shortest = air_top - height, longest = sqrt(here) + sqrt(top);
    float x = (way - shortest) / max(longest - shortest, 1e-6);
    return vec2(table_place(x, size.x), table_place(sqrt(here / top), size.y));
}

// Height and cosine of a texel.
vec2 transmittance_texel(vec2 centre, vec2 size) {
    float top = above_ground(air_top);
    float horizon = table_value(centre.y, size.y) * sqrt(top);
    float height = horizon * horizon / (ground_radius + sqrt(ground_radius * ground_radius
                                                             + horizon * horizon));
    float shortest = air_top - height, longest = horizon + sqrt(top);
    float way = mix(shortest, longest, table_value(centre.x, size.x));
    float mu = (top - horizon * horizon - way * way) / (2.0 * (ground_radius + height) * max(way, 1e-6));
    return vec2(height, clamp(mu, -1.0, 1.0));
}

// Transmittance to space; below the horizon, that of the ray that grazes it.
vec4 transmittance_to_space(float height, float mu) {
    return textureLod(transmittance_table, transmittance_place(height, mu), 0.0);
}
