// A pixel's ray in the space where the ellipsoid is the unit sphere, |o + t d| = 1:
// t^2 dd + 2 t od + (oo - 1) = 0, oo - 1 taken in float64 outside.
#include "block/planet"

struct Ray {
    vec3 d;
    float dd;
    float od;
    float discriminant;
};

// pixel : of the target [pixels]
Ray ray_through(vec2 pixel) {
    vec3 d = mat3(sphere_from_camera) * normalize(vec3((pixel - intrinsics.zw) / intrinsics.xy, 1.0));
    float dd = dot(d, d), od = dot(camera_in_sphere.xyz, d);
    return Ray(d, dd, od, od * od - dd * outside);
}

// Half the ray's way inside the sphere that the clouds lie on, squared, times dd; negative past it.
float clouds_discriminant(Ray ray) {
    return ray.od * ray.od - ray.dd * cloud_outside;
}

// Where a ray meets that sphere: first, or out of its inside.
float clouds_t(Ray ray, float discriminant) {
    float root = sqrt(max(discriminant, 0.0));
    return cloud_outside > 0.0 ? cloud_outside / (root - ray.od) : (root - ray.od) / ray.dd;
}
