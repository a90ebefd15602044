// A sparse matrix, row by row: the entries of row i are those from starts[i] to before
// starts[i + 1], each a column and the bits of a float.
layout(std430, binding = 0) readonly buffer Starts { uint starts[]; };
layout(std430, binding = 1) readonly buffer Entries { uvec2 entries[]; };
