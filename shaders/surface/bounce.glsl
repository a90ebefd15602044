#include "surface/material.glsl"

// Radiance of the light from other surfaces of the spacecraft that this one turns to the viewer
// [W m-2 sr-1]; solved per vertex for every frame (simgl/radiosity/solver.py).
vec4 bounced_light(Surface s, Albedo albedo) {
    return albedo.diffuse * s.indirect / PI + albedo.glossy * s.seen + albedo.coat * s.coat_seen;
}
