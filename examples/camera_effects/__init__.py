"""One scene through each effect of a detector alone, and through all of them."""
