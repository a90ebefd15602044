// Between the tables of four angles of the Sun, which hold roots of light.
#include "block/airmix"

// Of the nodes, one table under the other in slots.
uniform sampler2D node_light;

out vec4 light;

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy);
    int part = texel.y / part_rows;
    ivec4 rows = texel.y + slot_rows * node_slots[part];
    mat4 nodes = mat4(texelFetch(node_light, ivec2(texel.x, rows.x), 0),
                      texelFetch(node_light, ivec2(texel.x, rows.y), 0),
                      texelFetch(node_light, ivec2(texel.x, rows.z), 0),
                      texelFetch(node_light, ivec2(texel.x, rows.w), 0));
    // A cubic may swing below 0 where light ends.
    light = max(nodes * node_weights[part], 0.0);
}
