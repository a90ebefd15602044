// An ellipse in the picture, a sheared and scaled unit circle whose rows stay rows: an offset d from
// its centre [pixels] has the coordinates (scale.x (d.x + shear d.y), scale.y d.y).
struct Ellipse {
    vec2 centre;
    vec2 scale;
    float shear;
};

// Angles [rad] between which the circle's rows sin(t) cross the pixel whose corner lies `corner`
// from the centre; equal where none does.
vec2 rows_of_pixel(Ellipse e, vec2 corner) {
    vec2 y = clamp(e.scale.y * vec2(corner.y, corner.y + 1.0), -1.0, 1.0);
    return vec2(atan(y.x, sqrt(1.0 - y.x * y.x)), atan(y.y, sqrt(1.0 - y.y * y.y)));
}

// Rounding leaves a millionth or ten of a pixel in a disc uncovered; the Sun would shine through.
float full_if_nearly(float share) {
    return share > 0.9999 ? 1.0 : share;
}

// The pixel's stretch, in the circle, of its row at angle t.
vec2 stretch_of_pixel(Ellipse e, vec2 corner, float t) {
    float left = corner.x + e.shear * sin(t) / e.scale.y;
    return clamp(e.scale.x * vec2(left, left + 1.0), -cos(t), cos(t));
}
