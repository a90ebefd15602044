// Texels of textures whose sampler takes the nearest one, and the outermost ones for those beyond.
//
// llvmpipe looks up the size of the level for each of the places that it fetches from, which takes as long
// as all the rest of a fetch. Through a sampler without levels it does not.

vec4 texel(sampler2D map, ivec2 at) {
    return textureLod(map, (vec2(at) + 0.5) / vec2(textureSize(map, 0)), 0.0);
}

// width : of a texel, as a part of the texture; for loops, which llvmpipe works it out in
vec4 texel(sampler2D map, ivec2 at, vec2 width) {
    return textureLod(map, (vec2(at) + 0.5) * width, 0.0);
}

uvec4 texel(usampler2D map, ivec2 at) {
    return textureLod(map, (vec2(at) + 0.5) / vec2(textureSize(map, 0)), 0.0);
}
