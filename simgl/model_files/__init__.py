"""Spacecraft models from files: glTF, OBJ, STL, model cards, finishes."""
