"""Lamps on patches: shadows traced from a grid of places are those of the lamp's own place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

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


def test_shadows_between_places_of_the_grid_are_those_of_the_lamp() -> None:
    transport = open_box()
    points = transport.sample_points
    starts, ends = points.places.T, np.full(len(points.patch), 1.0 - 1e-3, dtype=np.float32)
    chosen = np.flatnonzero(points.open)
    for lamp in nearing(12):
        ways = lamp.place.astype(np.float32) - starts
        at_lamp = ~transport.tracer.occluded(starts, ways, ends)[chosen]
        # Four weights in float32 add up to 1 but for 1e-7.
        share = LampLight(transport).seen(lamp.place, chosen).round(6)
        # A cube of the grid is 0.9 % of the distance from the box wide, less than 3 m, and what
        # shades is less than half as far: edges are a band of less than 2 cm. They are 8 m long,
        # seen from above, inside and outside of the box; its surfaces are 16 m2, both sides.
        edges = np.count_nonzero((share > 0.0) & (share < 1.0)) / len(chosen)
        assert 0.0 < edges < 2.0 * 8.0 * 0.02 / 16.0
        # The edge itself is in that band.
        assert share[at_lamp].min() > 0.0
        assert share[~at_lamp].max() < 1.0
        # As much is added on one side of an edge as is taken on the other: a tenth of the band.
        assert abs(share.sum() - np.count_nonzero(at_lamp)) < 0.1 * 0.02 * len(chosen)


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
