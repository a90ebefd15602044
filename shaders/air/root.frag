// Roots of the sums that view.frag has added up: the fourth of light, the eighth of TRANSMITTANCE.
uniform sampler2D air_sums;

out vec4 root;

void main() {
    root = sqrt(sqrt(texelFetch(air_sums, ivec2(gl_FragCoord.xy), 0)));
#ifdef TRANSMITTANCE
    root = sqrt(root);
#endif
}
