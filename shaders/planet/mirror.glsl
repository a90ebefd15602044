// What the sea mirrors of the sky, as cubics of the view's cosine (simgl/physics/sea_surface.py).
#include "block/planet"

float cubic(vec4 law, float x) {
    return ((law.w * x + law.z) * x + law.y) * x + law.x;
}

// Share of an even sky that waves send towards cosine `mu` of the view: Schlick's form of Fresnel's
// law, at the incidence that waves leave.
float sky_in_waves(float mu) {
    float off = clamp(1.0 - cubic(sea_mirror[0], mu), 0.0, 1.0);
    float off2 = off * off;
    return 0.021 + 0.979 * off2 * off2 * off;
}
