// Part of the pixel on the positive side of a level line, from a value that vanishes on the line.
float coverage(float value) {
    float gradient = length(vec2(dFdx(value), dFdy(value)));
    return clamp(0.5 + value / max(gradient, 1e-30), 0.0, 1.0);
}

// Mean root of a value over the part of the pixel where it is positive. Near the line, where the root
// bends, that is not the root at the pixel's middle.
float mean_root(float value) {
    float gradient = max(length(vec2(dFdx(value), dFdy(value))), 1e-30);
    if (value > 8.0 * gradient) return sqrt(value);
    float high = max(value + 0.5 * gradient, 0.0), low = max(value - 0.5 * gradient, 0.0);
    return 2.0 / 3.0 * (high * sqrt(high) - low * sqrt(low)) / max(high - low, 1e-30);
}
