// Light between the stars, linear between the grid's nodes [W m-2 sr-1].
in vec4 light;

out vec4 radiance;

void main() {
    radiance = light;
}
