// Between the tables of four angles of the Sun, which hold roots of light, and between their columns.
#include "block/airmix"
#include "air/places.glsl"

// Of the nodes, one table under the other in slots.
uniform sampler2D node_light;

out vec4 light;

// Of four places -1, 0, 1, 2 in the cubic through them at x.
vec4 cubic(float x) {
    vec4 from = x + vec4(1.0, 0.0, -1.0, -2.0);
    return vec4(-from.y * from.z * from.w / 6.0, from.x * from.z * from.w / 2.0,
                -from.x * from.y * from.w / 2.0, from.x * from.y * from.z / 6.0);
}

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy);
    int part = texel.y / part_rows;
    ivec4 rows = texel.y + slot_rows * node_slots[part];
    int last = textureSize(node_light, 0).x - 1;
    float place = table_value(gl_FragCoord.x, mix_columns) * float(last);
    // Light is even about the Sun's vertical plane; on the far side the last four columns serve.
    int column = min(int(place), last - 2);
    vec4 weights = cubic(place - float(column));
    light = vec4(0.0);
    for (int i = 0; i < 4; ++i) {
        int x = abs(column + i - 1);
        mat4 nodes = mat4(texelFetch(node_light, ivec2(x, rows.x), 0),
                          texelFetch(node_light, ivec2(x, rows.y), 0),
                          texelFetch(node_light, ivec2(x, rows.z), 0),
                          texelFetch(node_light, ivec2(x, rows.w), 0));
        light += nodes * node_weights[part] * weights[i];
    }
    // A cubic may swing below 0 where light ends.
    light = max(light, 0.0);
}
