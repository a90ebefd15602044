"""Generators of the spacecraft models that ship with simgl."""
