// Between the tables of four angles of the Sun, which hold roots of light, and between their columns.
#include "block/airmix"
#include "air/view.glsl"

// Of the nodes, one table under the other in slots.
uniform sampler2D node_light;

out vec4 light;

// Of four places -1, 0, 1, 2 in the cubic through them at x.
vec4 cubic(float x) {
    vec4 from = x + vec4(1.0, 0.0, -1.0, -2.0);
    return vec4(-from.y * from.z * from.w / 6.0, from.x * from.z * from.w / 2.0,
                -from.x * from.y * from.w / 2.0, from.x * from.y * from.z / 6.0);
}

// Angle at the Earth's centre from the camera to where the ray of a row passes the height of the
// nodes, forward: the rise times the tangent of the ray's angle from nadir there.
float angle_to_nodes(float row) {
    float d = d_of_row(row);
    // Along a level ray the root of twice the rise is the angle. Inside the air nothing rises.
    return rise * sqrt((1.0 - d) / max(outside_air + d, 2.0 * abs(rise) + 1e-12));
}

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy);
    int part = texel.y / part_rows;
    ivec4 rows = texel.y + slot_rows * node_slots[part];
    int last = textureSize(node_light, 0).x - 1;
    // A ray has the same light from anywhere in space, but the Sun's angle from the zenith, and the
    // ray's azimuth from the Sun, are others at the height of the nodes.
    float across = table_value(gl_FragCoord.x, view_columns);
    float way = angle_to_nodes(float(texel.y));
    float sun_change = way * (2.0 * across * across - 1.0);
    across += way * across * (1.0 - across * across) * camera_sun.x / max(camera_sun.y, 1e-3);
    float place = across * float(last);
    // Light is even about the Sun's vertical plane; on the far side the last four columns serve.
    int column = min(int(place), last - 2);
    vec4 weights = cubic(place - float(column));
    vec4 node_weights = cubic(node_places[part].x + nodes_per_radian * sun_change);
    light = vec4(0.0);
    for (int i = 0; i < 4; ++i) {
        int x = abs(column + i - 1);
        mat4 nodes = mat4(texelFetch(node_light, ivec2(x, rows.x), 0),
                          texelFetch(node_light, ivec2(x, rows.y), 0),
                          texelFetch(node_light, ivec2(x, rows.z), 0),
                          texelFetch(node_light, ivec2(x, rows.w), 0));
        light += nodes * node_weights * weights[i];
    }
    // A cubic may swing below 0 where light ends.
    light = max(light, 0.0);
}
