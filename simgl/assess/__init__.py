"""Lighting assessment: what an image is worth to whoever has to use it."""
