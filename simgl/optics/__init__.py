"""The lens on the CPU: kernels of its point spread, convolution, distortion maps, ghosts."""
