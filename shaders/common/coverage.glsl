// Part of the pixel on the positive side of a level line, from a value that vanishes on the line.
float coverage(float value) {
    float gradient = length(vec2(dFdx(value), dFdy(value)));
    return clamp(0.5 + value / max(gradient, 1e-30), 0.0, 1.0);
}
