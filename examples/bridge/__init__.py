"""Loops of a page: what a GNC program does with the image service."""
