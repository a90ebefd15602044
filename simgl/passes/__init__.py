"""Passes: one file each, with its blocks, its complete state and its draw. None imports another."""
