// How many cells of the coarse grid cover an image.
ivec2 cells_of(ivec2 image) { return (image + CELL - 1) / CELL; }

// The place of a pixel between the centres of the cells, which count from 0.
vec2 among_cells(vec2 pixel, ivec2 cells) {
    return clamp((pixel + 0.5) / float(CELL) - 0.5, vec2(0.0), vec2(cells - 1));
}
