// Brown-Conrady distortion in OpenCV's convention, of tangents x / z and y / z.
//
// radial: k1 k2 k3, p1; rational: k4 k5 k6, p2.
vec2 distorted(vec2 t, vec4 radial, vec4 rational) {
    float q = dot(t, t);
    float scale = (1.0 + q * (radial.x + q * (radial.y + q * radial.z)))
                / (1.0 + q * (rational.x + q * (rational.y + q * rational.z)));
    float p1 = radial.w, p2 = rational.w;
    return t * scale + 2.0 * t.x * t.y * vec2(p1, p2) + (q + 2.0 * t * t) * vec2(p2, p1);
}
