"""Cameras as data, the presets that describe them, and what of them runs on the CPU."""
