// Corners of one triangle over the whole viewport, at a depth -1..1; from the fourth vertex on of another at
// the opposite depth.
#ifndef AT_DEPTH
#define AT_DEPTH 0.0
#endif

vec4 corner_of_screen() {
    int place = gl_VertexID % 3;
    vec2 corner = vec2(place == 1 ? 3.0 : -1.0, place == 2 ? 3.0 : -1.0);
    return vec4(corner, gl_VertexID < 3 ? AT_DEPTH : -AT_DEPTH, 1.0);
}
