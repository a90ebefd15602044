// Texels of textures whose sampler takes the nearest one, and for places past the edges the outermost.
//
// A texelFetch of llvmpipe looks up the size of the level for each place anew: half of all that it does.
// Through a sampler without levels it does not. In compute shaders, which are for GPUs, both cost the same.

#ifdef COMPUTE
vec4 read_texel(sampler2D map, ivec2 at) { return texelFetch(map, at, 0); }

uvec4 read_texel(usampler2D map, ivec2 at) { return texelFetch(map, at, 0); }
#else
vec4 read_texel(sampler2D map, ivec2 at) {
    return textureLod(map, (vec2(at) + 0.5) / vec2(textureSize(map, 0)), 0.0);
}

uvec4 read_texel(usampler2D map, ivec2 at) {
    return textureLod(map, (vec2(at) + 0.5) / vec2(textureSize(map, 0)), 0.0);
}
#endif

// width : of a texel, as a part of the texture, for loops: llvmpipe works it out in each turn
vec4 read_texel(sampler2D map, ivec2 at, vec2 width) {
#ifdef COMPUTE
    return texelFetch(map, at, 0);
#else
    return textureLod(map, (vec2(at) + 0.5) * width, 0.0);
#endif
}
