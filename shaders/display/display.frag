// What a screen shows of a radiance image: exposure, white point, colours, sRGB transfer.
//
// The only place where light is clamped. The image keeps row 0 at its top, the window at its bottom.
#include "block/display"

uniform sampler2D radiance;

out vec4 shown;

// sRGB code value 0..1 of linear light 0..1 (IEC 61966-2-1).
vec3 srgb_from_linear(vec3 linear) {
    vec3 x = clamp(linear, 0.0, 1.0);
    return mix(1.055 * pow(x, vec3(1.0 / 2.4)) - 0.055, 12.92 * x, lessThanEqual(x, vec3(0.0031308)));
}

void main() {
    vec2 place = (gl_FragCoord.xy - rectangle.xy) / rectangle.zw;
    vec2 texel = vec2(place.x, 1.0 - place.y) * vec2(textureSize(radiance, 0));
    vec4 L = texelFetch(radiance, ivec2(texel), 0);
    vec3 bands = vec3(L[shown_channels.x], L[shown_channels.y], L[shown_channels.z]) / white_radiance.rgb;
    vec3 linear = srgb_from_bands[0].rgb * bands.r + srgb_from_bands[1].rgb * bands.g
                + srgb_from_bands[2].rgb * bands.b;
    shown = vec4(srgb_from_linear(linear), 1.0);
}
