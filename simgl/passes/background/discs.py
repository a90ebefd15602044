"""The uniform fields of discs on the sky, shared by the passes that draw the Sun and the Moon."""

from __future__ import annotations

from typing import Any

import numpy as np

from simgl.view.celestial import Ellipse

MAX_NODES = 8
# Below this radius [pixels] a pixel may hold a good part of the disc.
_SMALL = 16.0

FIELDS: list[tuple[Any, ...]] = [
    # Gauss's rule on 0..1: place, weight.
    ("nodes", "f4", (MAX_NODES, 4)),
    ("ellipse_centre", "f4", 2),
    ("ellipse_scale", "f4", 2),
    ("ellipse_shear", "f4"),
    ("node_count", "i4"),
]


def disc_values(ellipse: Ellipse) -> dict[str, Any]:
    """The fields that place a disc, for ``common/ellipse.glsl``."""
    count = MAX_NODES if ellipse.radius < _SMALL else 3
    place, weight = np.polynomial.legendre.leggauss(count)
    nodes = np.zeros((MAX_NODES, 4))
    nodes[:count, 0], nodes[:count, 1] = 0.5 * (place + 1.0), 0.5 * weight
    (a, b), (_, c) = ellipse.form
    return {
        "nodes": nodes,
        "ellipse_centre": ellipse.centre,
        "ellipse_scale": (np.sqrt(a), np.sqrt(c - b * b / a)),
        "ellipse_shear": b / a,
        "node_count": count,
    }
