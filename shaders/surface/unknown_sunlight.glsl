// In place of a share of the sunlight that is not known yet: who tells it (surface/sunlight.frag); in
// the second place, how high above the point casters can stand that matter [m].
const float SEARCH_TELLS = -1.0;
const float NEIGHBOURS_TELL = -2.0;
