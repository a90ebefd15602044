// Part of the pixel on the positive side of a level line, from a value that vanishes on the line.
float coverage(float value) {
    float gradient = length(vec2(dFdx(value), dFdy(value)));
    return clamp(0.5 + value / max(gradient, 1e-30), 0.0, 1.0);
}

// Root of a value at a pixel's middle; in a pixel across the level line its mean over the part where
// the value is positive.
float covered_root(float value) {
    float gradient = length(vec2(dFdx(value), dFdy(value)));
    if (value >= 0.5 * gradient) return sqrt(value);
    return 2.0 / 3.0 * sqrt(max(value + 0.5 * gradient, 0.0));
}
