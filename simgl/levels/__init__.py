"""Coarser triangles over the vertices of a mesh, for spacecraft that are far away."""
