"""Lamps on patches: shadows traced from a grid of places are those of the lamp's own place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simgl.radiosity.incident_light import incident_light
from simgl.radiosity.lamp_light import LampLight, SpotLight
from tests.radiosity.boxes import open_box
from tests.radiosity.near_spacecraft import two_boxes

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


def test_a_rounded_lamp_gives_a_thousandth_more_or_less() -> None:
    transport = open_box()
    light, share = LampLight(transport), []
    for lamp in nearing(12):
        rounded = lamp.in_steps(light.gap(lamp))
        # Half a step along each axis is 0.17 % of the distance; that of one, twice that of light.
        assert np.linalg.norm(rounded.place - lamp.place) < 0.0017 * light.gap(lamp)
        assert np.linalg.norm(rounded.axis - lamp.axis) < 0.0034
        areas = transport.areas
        share.append(areas @ light.irradiance(rounded) / (areas @ light.irradiance(lamp)) - 1.0)
    assert np.abs(share).max() < 0.0034
    # Steps of 3.9 mm: on 6.6 mm of way each axis takes two at most, one after another.
    slow = [replace(LAMP, place=LAMP.place + frame * np.full(3, -6e-4)) for frame in range(12)]
    assert len({lamp.in_steps(light.gap(lamp)).beam for lamp in slow}) <= 1 + 3 * 2


def test_what_carries_a_lamp_goes_with_it_when_it_is_rounded() -> None:
    state = (scenario := two_boxes(3.0, (-0.8, 0.0, 0.6))).at(scenario.epoch_tai_ns)
    first = next(iter(state.bodies.values()))
    (other,) = incident_light(state, first).around
    back = np.linalg.inv(other.other_from_body)
    on_it, off_it = (back @ (*place, 1.0) for place in ((0.0, 0.1, 0.5), (0.0, 9.0, 0.0)))
    for place, carried in ((on_it[:3], True), (off_it[:3], False)):
        lamp = replace(LAMP, place=place)
        rounded = lamp.in_steps(3.0)
        there = other.around_lamp(lamp, rounded, 3.0).other_from_body
        if carried:
            before, after = (
                m @ (*p, 1.0) for m, p in ((other.other_from_body, place), (there, rounded.place))
            )
            # What is left of a place without rounding errors: half a micrometre along each axis.
            np.testing.assert_allclose(after, before, atol=1e-6)
        else:
            np.testing.assert_array_equal(there, other.other_from_body)
