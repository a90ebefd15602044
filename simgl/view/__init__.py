"""What a camera sees, float32 in its axes: the state made ready for the passes."""
