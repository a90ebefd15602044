// How much of a uniform light a surface turns to the viewer, lobe by lobe. The table is made by
// quadrature in simgl/physics/directional_albedo.py, which the base's polynomial repeats to 1e-5.

uniform sampler2D lobe_table;

// Directional albedo of the GGX lobe.
//
// f0 : reflectance at normal incidence; alpha : width of the lobe, roughness^2
vec4 lobe_albedo(vec4 f0, float NoV, float alpha) {
    float nodes = float(textureSize(lobe_table, 0).x);
    vec2 place = sqrt(clamp(vec2(NoV, alpha), 0.0, 1.0));
    vec2 split = textureLod(lobe_table, (place * (nodes - 1.0) + 0.5) / nodes, 0.0).rg;
    return f0 * split.x + split.y;
}

// Mean of 1 - (1 - VoH)^5 over a uniform sky, weighted by its cosine: the share of the light past
// Fresnel's term at normal incidence that the base gets.
float base_share(float NoV) {
    float low = 0.0281691 - NoV * (0.0799209 - NoV * 0.0866869);
    float high = 0.0439607 - NoV * 0.0091090;
    return 1.0 - low + NoV * NoV * NoV * high;
}
