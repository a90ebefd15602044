"""Pictures along a trajectory: epochs, a run that can be broken off, its table, its video."""
