"""Short GNC loops that use the image service."""
