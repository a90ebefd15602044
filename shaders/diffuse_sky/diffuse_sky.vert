// One cell of the grid, an instance each, as a strip of two triangles.

// Radiance at the grid's nodes [W m-2 sr-1], the image's first row first.
uniform sampler2D nodes;

out vec4 light;

void main() {
    ivec2 cells = textureSize(nodes, 0) - 1;
    ivec2 node = ivec2(gl_InstanceID % cells.x, gl_InstanceID / cells.x)
               + ivec2(gl_VertexID & 1, gl_VertexID >> 1);
    light = texelFetch(nodes, node, 0);
    gl_Position = vec4(2.0 * vec2(node) / vec2(cells) - 1.0, 0.0, 1.0);
}
