"""What the picture of the Earth costs beside passes that draw next to nothing."""
