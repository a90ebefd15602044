"""Reflected sunlight that is made ahead is there in time, and is what a frame makes by itself."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from simgl.arrays import Array
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.next_sunlight import NextSunlight
from simgl.radiosity.precomputed_response import PrecomputedResponse
from simgl.radiosity.solver import reflectors
from simgl.radiosity.sunlit_patches import (
    Node,
    SunlitPatches,
    corners_ahead,
    corners_next,
    grid_corners,
)
from tests.radiosity.boxes import open_box, white
from tests.radiosity.test_light_grids import baked

SUNLIGHT = np.array([154.0, 175.0, 172.0, 313.0])
# Of an orbit in frames 0.1 s apart, 7 mdeg, and 1 s apart: 70 and 7 frames from one edge of the
# grid to another.
PACES = np.radians([0.0068, 0.068])
# The same 5 and 30 s apart: the Sun comes to other directions of the grid in each frame.
LONG_PACES = np.radians([0.34, 2.0])


def way(pace: float, frames: int) -> list[Array]:
    """(frames, 3) unit directions along a great circle, a step of so many radians apart."""
    along, across = np.array([0.4, 0.3, 0.3]), np.array([0.3, -0.4, 0.0])
    along, across = along / np.linalg.norm(along), across / np.linalg.norm(across)
    return [np.cos(pace * i) * along + np.sin(pace * i) * across for i in range(frames)]


def nodes_of(direction: Array) -> set[Node]:
    return {node for node, _ in grid_corners(direction)}


@pytest.mark.parametrize("pace", PACES)
def test_the_corners_ahead_are_those_that_an_even_motion_needs(pace: float) -> None:
    directions = way(pace, 301)
    entered = [i for i in range(1, 300) if nodes_of(directions[i]) != nodes_of(directions[i - 1])]
    for frame in range(1, entered[-2]):
        coming = [i for i in entered if i > frame + 1]
        found = list(corners_ahead(directions[frame - 1], directions[frame]))
        assert len(found) >= 1
        nodes, frames = found[0]
        # A great circle bends by less than a frame's step on its way through half a degree.
        assert frames + frame + 1 in range(coming[0] - 1, coming[0] + 2)
        assert set(nodes) in [nodes_of(directions[coming[0] + i]) for i in (0, 1)]


def test_nothing_is_ahead_of_a_sun_that_stands_jumps_or_has_far_to_go() -> None:
    first, second, third = way(PACES[0], 3)
    assert not list(corners_ahead(first, first))
    assert list(corners_ahead(first, third))
    assert not list(corners_ahead(-second, third))
    assert not list(corners_ahead(first, way(1e-4 * PACES[0], 2)[1]))


@pytest.mark.parametrize("traced", [open_box, baked], ids=["vertices", "grids"])
def test_what_is_made_in_parts_has_the_bits_of_what_is_made_at_once(
    traced: Callable[[], LightTransport],
) -> None:
    transport = traced()

    def response() -> PrecomputedResponse:
        surface = reflectors(transport, white(0.8))
        return PrecomputedResponse(transport, surface, SunlitPatches(transport))

    at_once, in_parts = response(), response()
    direction = way(PACES[0], 1)[0]
    for node in nodes_of(direction):
        count = in_parts.parts_left(node)
        assert count == 5 + 2 * (transport.grids is not None) + (transport.cells is not None)
        for left in range(count, 0, -1):
            assert in_parts.parts_left(node) == left
            in_parts.make_part(node)
        assert in_parts.parts_left(node) == 0
    one, other = (r.of_sun_at_vertices(direction, SUNLIGHT) for r in (at_once, in_parts))
    np.testing.assert_array_equal(one.vertices, other.vertices)
    np.testing.assert_array_equal(one.nodes, other.nodes)
    assert np.any(one.vertices)


@pytest.mark.parametrize("pace", LONG_PACES)
def test_the_corners_after_equal_long_steps_are_those_of_the_next_frame(pace: float) -> None:
    directions = way(pace, 100)
    found = [set(corners_next(*directions[i : i + 3])) for i in range(97)]
    # A great circle bends by the square of a step, 4e-5 or 1e-3 rad: where that leads to the
    # triangle beside, both share two corners. One edge in pace / 0.5 deg is passed, or is near.
    same = [nodes == nodes_of(directions[i + 3]) for i, nodes in enumerate(found)]
    assert np.mean(same) > (0.97 if pace < 0.01 else 0.7)
    assert all(len(nodes & nodes_of(directions[i + 3])) >= 2 for i, nodes in enumerate(found))


def test_no_corners_are_next_after_short_or_unequal_steps() -> None:
    first, second, third, fourth = way(LONG_PACES[0], 4)
    assert corners_next(first, second, third)
    assert not corners_next(first, second, fourth)
    assert not corners_next(second, first, second)
    assert not corners_next(second, second, third)
    assert not corners_next(*way(PACES[1], 3))


def test_a_sun_in_long_steps_finds_its_light_made() -> None:
    """In all frames but the first three, in which no two equal steps are known yet."""
    transport = open_box()
    response = PrecomputedResponse(
        transport, reflectors(transport, white(0.8)), SunlitPatches(transport)
    )
    ahead, lacking = NextSunlight(), 0
    for frame, direction in enumerate(way(LONG_PACES[0], 60)):
        if frame > 2:
            lacking += sum(response.parts_left(node) > 0 for node in nodes_of(direction))
        response.of_sun_at_vertices(direction, SUNLIGHT)
        ahead.make_ahead(0, response, direction)
    # A corner of a triangle that the bend of the way leads to.
    assert lacking <= 1


@pytest.mark.parametrize("pace", PACES)
def test_a_sun_on_the_move_finds_its_light_made(pace: float) -> None:
    """In all frames but the first two, in which no motion is known yet."""
    transport = open_box()
    response = PrecomputedResponse(
        transport, reflectors(transport, white(0.8)), SunlitPatches(transport)
    )
    ahead = NextSunlight()
    entered: set[Node] = set()
    for frame, direction in enumerate(way(pace, 200)):
        lacking = sum(response.parts_left(node) for node in nodes_of(direction))
        assert frame < 2 or not lacking
        entered |= nodes_of(direction)
        response.of_sun_at_vertices(direction, SUNLIGHT)
        ahead.make_ahead(0, response, direction)
    # Not all of it was there from the start.
    assert len(entered) > 3


def test_spacecraft_of_one_model_share_what_is_made_ahead() -> None:
    """Each in a thread of its own."""
    transport = open_box()
    surface = reflectors(transport, white(0.8))
    response = PrecomputedResponse(transport, surface, SunlitPatches(transport))
    ahead = NextSunlight()
    directions = way(PACES[1], 60)
    with ThreadPoolExecutor(4) as executor:
        for direction in directions:
            tasks = [
                executor.submit(ahead.make_ahead, instance, response, direction)
                for instance in range(4)
            ]
            for task in tasks:
                task.result()
