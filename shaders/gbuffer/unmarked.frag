// Sets the depth of all shading points to that of points of other spacecraft.

void main() {}
