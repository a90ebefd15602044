"""Light between surfaces: its time in a frame, and what solving beforehand leaves out."""
