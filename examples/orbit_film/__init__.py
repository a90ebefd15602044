"""One orbit in 24 frames, and the Earth from every distance."""
