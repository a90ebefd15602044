"""Lamps on patches: shadows traced from a grid of places are those of the lamp's own place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simgl.arrays import Array
from simgl.radiosity.lamp_light import LampLight, SpotLight
from tests.radiosity.boxes import open_box

# Above the open box's rim, at an angle: its walls shade a part of its floor.
LAMP = SpotLight(
    place=np.array([3.1, 1.7, 2.9]),
    axis=np.array([-0.6, -0.37, -0.71]),
    half_angle=0.4,
    edge=0.1,
    intensity=np.full(4, 10.0),
)


def nearing(frames: int) -> list[SpotLight]:
    """A lamp on its way to the box, a centimetre from frame to frame."""
    way = np.array([-0.006, -0.004, -0.007])
    return [replace(LAMP, place=LAMP.place + frame * way) for frame in range(frames)]


def shaded_edge(place: Array) -> float:
    """Length of the shadow's edge on the box's floor and its walls, 2 m x 1 m x 1 m, at most [m]."""
    return 2.0 + 1.0 + 2.0 * np.hypot(1.0, float(np.linalg.norm(place)) / float(place[2]))


def test_shadows_move_by_less_than_the_grid_of_places() -> None:
    transport = open_box()
    points = transport.few_points
    for lamp in nearing(12):
        towards = (lamp.place[:, None] - points.places).T.astype(np.float32)
        ends = np.full(len(towards), 1.0 - 1e-3, dtype=np.float32)
        starts = np.ascontiguousarray(points.places.T)
        free = ~transport.tracer.occluded(starts, towards, ends) & points.open
        exact = LampLight(transport)
        at_lamp = exact.sees(lamp.place, np.flatnonzero(points.open))
        wrong = at_lamp != free[points.open]
        # A band along the edge as wide as half a step's diagonal, 0.7 % of the distance from the
        # box, seen from at most its length, 2.4 m, and as obliquely as it is here: twice that.
        area = 2.0 * shaded_edge(lamp.place) * 0.0068 * 2.4
        density = len(points.patch) / (2.0 * transport.areas.sum())
        assert np.count_nonzero(wrong) < 0.5 + 2.0 * area * density


def test_a_lamp_gives_the_same_bits_whatever_came_before() -> None:
    transport, after_others = open_box(), LampLight(open_box())
    for lamp in nearing(12):
        found = after_others.irradiance(lamp)
        np.testing.assert_array_equal(found, LampLight(transport).irradiance(lamp))
        # Turned away and back: other points are asked for from the same place.
        after_others.irradiance(replace(lamp, axis=np.array([0.0, 0.0, -1.0])))
        np.testing.assert_array_equal(found, after_others.irradiance(lamp))


def test_a_lamp_inside_a_body_s_box_is_traced_from_its_own_place() -> None:
    """It may be as near to a surface as it likes: the next place of a grid may lie behind it."""
    transport = open_box()
    low, high = transport.box
    for height in (1e-3, 1e-4):
        floor = replace(LAMP, place=np.array([1.0, 0.5, height]), axis=np.array([0.0, 0.6, 0.8]))
        assert np.all((floor.place > low) & (floor.place < high))
        assert LampLight(transport).irradiance(floor).max() > 0.0
