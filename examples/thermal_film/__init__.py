"""A spacecraft through the Earth's shadow, in visible light and in the thermal infrared."""
