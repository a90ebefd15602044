// Blocks of a tile's cells.
#include "block/tile"

const int LAYERS = 8;   // groups of a cell, one above the other in the targets of shading points
const int BLOCK = 32;   // cells along an edge
