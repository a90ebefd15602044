// Noise over the whole sphere from one periodic volume (simgl/scene/noise_volume.py).
uniform sampler3D noise_volume;

// The volume lies askew to the poles and the equator: rows are unit vectors.
const mat3 NOISE_FROM_ITRF = mat3(0.6961, 0.5873, -0.4130,
                                 -0.1840, 0.7064, 0.6834,
                                  0.6931, -0.3997, 0.5998);

// A direction or distance in the volume.
vec3 noise_step(vec3 shift, float tile) {
    return NOISE_FROM_ITRF * (shift / tile);
}

// Place in the volume of `place` [any unit] where one repetition is `tile` long [same unit].
//
// Slow waves bend the cut, so that no part of the sphere runs along a face of the volume, where the
// pattern would repeat.
vec3 noise_place(vec3 place, float tile) {
    vec3 x = noise_step(place, tile);
    vec3 t = fract(0.175 * x.yzx) - 0.5;
    return x + 1.2 * t * (1.0 - 2.0 * abs(t));
}
