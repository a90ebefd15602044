"""Open frames of thin rods: trusses and booms."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from simgl.arrays import Array
from tools.spacecraft_models.shapes import Shape, rod


def boom(
    material: str,
    section: ArrayLike,
    y: tuple[float, float],
    bays: int,
    radii: tuple[float, float],
    segments: int = 6,
) -> list[Shape]:
    """A boom along the y axis: longerons at the corners, frames between bays, a diagonal a face.

    section : (k, 2) x and z of the corners, in order round the section [m]
    y : its ends [m]
    radii : of the longerons, and of the frames and diagonals [m]
    """
    corners = np.asarray(section, dtype=float)
    stations = np.linspace(*y, bays + 1)

    def corner(index: int, station: float) -> Array:
        x, z = corners[index % len(corners)]
        return np.array([x, station, z])

    thick, thin = radii

    def strut(start: Array, end: Array) -> Shape:
        # It ends inside the longerons, short of their axes, where struts would share edges.
        inset = 0.5 * thick * (end - start) / np.linalg.norm(end - start)
        return rod(material, start + inset, end - inset, thin, segments)

    shapes = [
        rod(material, corner(i, y[0]), corner(i, y[1]), thick, segments)
        for i in range(len(corners))
    ]
    for bay, station in enumerate(stations):
        for i in range(len(corners)):
            shapes.append(strut(corner(i, station), corner(i + 1, station)))
            if bay < bays:
                # Neighbouring bays lean opposite ways.
                ends = (i, i + 1) if bay % 2 else (i + 1, i)
                start, end = corner(ends[0], station), corner(ends[1], stations[bay + 1])
                shapes.append(strut(start, end))
    return shapes


def chain(
    material: str, points: Sequence[ArrayLike], radius: float, segments: int = 12
) -> list[Shape]:
    """Rods from point to point [m], each running a radius past its ends, as an arm's booms do."""
    places = [np.asarray(point, dtype=float) for point in points]
    shapes = []
    for start, end in pairwise(places):
        along = radius * (end - start) / np.linalg.norm(end - start)
        shapes.append(rod(material, start - along, end + along, radius, segments))
    return shapes
