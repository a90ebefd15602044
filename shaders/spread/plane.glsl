// A plane is a weighted sum of the bands, as the lens illuminates the pixels. Of a pixel it is the
// same in every program, to the bit.
struct Plane {
    vec4 weights;  // [per W m-2 sr-1]
    float limit;   // what is brighter is spread elsewhere
};

uniform sampler2D radiance;

float plane_at(vec4 light, Plane plane, float illumination) {
    precise float red = plane.weights.r * light.r, green = plane.weights.g * light.g;
    precise float blue = plane.weights.b * light.b, infrared = plane.weights.a * light.a;
    precise float sum = ((red + green) + (blue + infrared)) * illumination;
    return sum;
}
