// Where a table of n texels along an axis keeps the value at x in 0..1, its ends at the centres of
// the first and the last texel; and back.
float table_place(float x, float n) {
    return (0.5 + clamp(x, 0.0, 1.0) * (n - 1.0)) / n;
}

float table_value(float texel_centre, float n) {
    return (texel_centre - 0.5) / (n - 1.0);
}
