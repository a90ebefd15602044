// Three tables of irradiance by surfaces in the Sun, each for 1 W m-2 in a direction of a grid, and
// how much of each there is [W m-2].
#ifdef SUNLIT
layout(std430, binding = 0) readonly buffer First { vec4 first[]; };
layout(std430, binding = 1) readonly buffer Second { vec4 second[]; };
layout(std430, binding = 2) readonly buffer Third { vec4 third[]; };
uniform vec4 of_first, of_second, of_third;

vec4 sunlight_at(int row) {
    return of_first * first[row] + of_second * second[row] + of_third * third[row];
}
#endif
