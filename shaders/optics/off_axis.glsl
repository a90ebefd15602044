// What a lens leaves of the light off its axis: cos^4, or what a map says in its place.
#ifdef MAPPED
uniform sampler2D relative_illumination;
#endif

// intrinsics : fx, fy, cx, cy [pixels]
float off_axis(ivec2 pixel, vec4 intrinsics) {
#ifdef MAPPED
    return read_texel(relative_illumination, pixel).r;
#else
    vec2 tangent = (vec2(pixel) + 0.5 - intrinsics.zw) / intrinsics.xy;
    float cos2 = 1.0 / (1.0 + dot(tangent, tangent));
    return cos2 * cos2;
#endif
}
