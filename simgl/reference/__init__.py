"""What the shaders compute, in numpy that reads like the textbook; tests compare the two."""
