// One triangle over the whole viewport, at a depth -1..1.
#ifndef AT_DEPTH
#define AT_DEPTH 0.0
#endif

void main() {
    vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
    gl_Position = vec4(corner, AT_DEPTH, 1.0);
}
