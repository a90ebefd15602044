#include "common/constants.glsl"

// How the normals within a shading point's part of its cell spread.
struct NormalSpread {
    float mean;     // as alpha^2 of a microfacet lobe, over both directions: the mean of the turns' squares over 3
    vec2 turn;      // of the normals, along the axis and across it [rad]
    vec3 axis;      // unit, square to the normal
};

// Two unit vectors square to a unit vector and to each other (Duff et al. 2017).
mat2x3 square_to(vec3 n) {
    float side = n.z < 0.0 ? -1.0 : 1.0;
    float a = -1.0 / (side + n.z), b = n.x * n.y * a;
    return mat2x3(vec3(1.0 + side * n.x * n.x * a, side * b, -side * n.x), vec3(b, side + n.y * n.y * a, -n.y));
}

// Normals and their spread as stored: the axis by the face normal's length, 1 to 2 for half a turn about
// the normal; how uneven by the normal's, 1 for equal to 2 for none across.
//
// spread : its mean, how uneven as a share of that, twice the angle of the axis from the first of `square_to` [rad]
void store_spread(inout vec4 normal, inout vec4 face_normal, vec3 spread) {
    normal = vec4((1.0 + spread.y) * normal.xyz, spread.x);
    face_normal.xyz *= 1.0 + fract(spread.z / (2.0 * PI));
}

NormalSpread stored_spread(vec4 normal, vec3 face_normal) {
    vec3 n = normalize(normal.xyz);
    float angle = PI * (length(face_normal) - 1.0);
    mat2x3 axes = square_to(n);
    float uneven = clamp(length(normal.xyz) - 1.0, 0.0, 1.0);
    vec2 turn = sqrt(3.0 * normal.w * (1.0 + vec2(uneven, -uneven)));
    return NormalSpread(normal.w, turn, cos(angle) * axes[0] + sin(angle) * axes[1]);
}
