// How much of a uniform light a surface turns to the viewer, lobe by lobe. The table is made by
// quadrature in simgl/physics/directional_albedo.py, which the base's polynomial repeats to 1e-5.

uniform sampler2D lobe_table;

// Of the GGX lobe: directional albedo as scale and bias of its reflectance at normal incidence; of the round
// lobe that stands for all directions from which a viewer gets its light, the sine between the normal and
// the axis over that of the viewer, and the roughness.
vec4 of_lobe(float NoV, float alpha) {
    float nodes = float(textureSize(lobe_table, 0).x);
    vec2 place = sqrt(clamp(vec2(NoV, alpha), 0.0, 1.0));
    return textureLod(lobe_table, (place * (nodes - 1.0) + 0.5) / nodes, 0.0);
}

// Its directional albedo.
//
// f0 : reflectance at normal incidence; alpha : width of the lobe, roughness^2
vec4 lobe_albedo(vec4 f0, float NoV, float alpha) {
    vec2 split = of_lobe(NoV, alpha).xy;
    return f0 * split.x + split.y;
}

// Mean of 1 - (1 - VoH)^5 over a uniform sky, weighted by its cosine: the share of the light past
// Fresnel's term at normal incidence that the base gets.
float base_share(float NoV) {
    float low = 0.0281691 - NoV * (0.0799209 - NoV * 0.0866869);
    float high = 0.0439607 - NoV * 0.0091090;
    return 1.0 - low + NoV * NoV * NoV * high;
}
