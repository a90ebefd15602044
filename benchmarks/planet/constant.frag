// The cheapest full-screen pass: one colour.
out vec4 radiance;

void main() {
    radiance = vec4(0.5);
}
