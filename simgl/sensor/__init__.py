"""What of a camera is computed on the CPU: random numbers, particles, blooming, shutter, views."""
