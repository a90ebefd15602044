"""Polynomials through values at Chebyshev's nodes."""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array


def chebyshev_nodes(count: int) -> Array:
    """(count,) of them in 0..1, both ends among them."""
    return 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, count))


def chebyshev_interpolation(count: int, places: Array) -> Array:
    """(n, count) from values at Chebyshev's nodes to their polynomial's at places in 0..1."""
    chebyshev = np.polynomial.chebyshev.chebvander
    nodes = 2.0 * chebyshev_nodes(count) - 1.0
    to_coefficients = np.linalg.inv(chebyshev(nodes, count - 1))
    return chebyshev(2.0 * places - 1.0, count - 1) @ to_coefficients
