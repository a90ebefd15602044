"""Passes: one file each, with its blocks, its complete GL state and its draw. None imports another."""
