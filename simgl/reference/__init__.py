"""What the shaders compute, in numpy float64 that reads like the textbook. Tests compare the two."""
