// What differs from pixel to pixel of one camera and never changes, four pixels of a row at a time.
//
// GAIN_MAP: response, 1 on average. DARK_MAP: dark current beyond that of every pixel [e- s-1].
// OFFSET_MAP: offset [e-].
#include "common/philox.glsl"
#include "block/pattern"

out vec4 value;

const uint PRNU = 8u, DEAD = 9u, HOT = 10u, DSNU = 11u, ROWS = 12u, COLUMNS = 13u;

// Random numbers in (0, 1) that stay with the camera for life.
vec4 random(uint counter, uint stream) {
    return uniform_01(philox(uvec4(counter, 0u, 0u, 0u), uvec2(serial, stream)));
}

void main() {
    uint row = uint(gl_FragCoord.y), group = uint(gl_FragCoord.x);
    uint place = group + (row << 16u);
#ifdef GAIN_MAP
    vec4 gain = max(1.0 + prnu * normal(random(place, PRNU)), 0.0);
    value = mix(gain, vec4(0.0), lessThan(random(place, DEAD), vec4(dead_pixels)));
#endif
#ifdef DARK_MAP
    // Of a u that is uniform in (0, share), -log(u / share) is exponential.
    vec4 u = random(place, HOT) / hot_pixels;
    value = mix(vec4(0.0), -hot_current * log(u), lessThan(u, vec4(1.0)));
#endif
#ifdef OFFSET_MAP
    value = dsnu * normal(random(place, DSNU)) + rows * normal(random(row, ROWS)).x
        + columns * normal(random(group, COLUMNS));
#endif
}
