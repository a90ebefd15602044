"""What is solved beforehand is what solving at once gives, whatever was asked before."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.arrays import Array, Array32
from simgl.lru_cache import LruCache
from simgl.radiosity.hemisphere import SKY_CELLS
from simgl.radiosity.precomputed_response import PrecomputedResponse
from simgl.radiosity.solver import RESIDUAL, radiosity, reflectors
from simgl.radiosity.sunlit_patches import SunlitPatches
from tests.radiosity.boxes import open_box, white

SUNLIGHT = np.array([154.0, 175.0, 172.0, 313.0])


def response(emission: float = 0.0) -> PrecomputedResponse:
    transport = open_box()
    return PrecomputedResponse(
        transport, reflectors(transport, white(0.8, emission=emission)), SunlitPatches(transport)
    )


def directions(count: int) -> Array:
    """(count, 3) unit, some of them on the lattice's lines and folds."""
    found = np.random.default_rng(3).normal(size=(count, 3))
    found[:4] = (0.0, 0.0, 1.0), (0.5, 0.5, 0.0), (-0.3, 0.0, 0.7), (0.0, -0.6, -0.4)
    return found / np.linalg.norm(found, axis=1)[:, None]


def cells() -> Array32:
    """(96, 4) radiance of an uneven sky."""
    return np.random.default_rng(4).uniform(0.0, 90.0, (SKY_CELLS, 4)).astype(np.float32)


def agree(found: Array32, at_once: Array32, own: Array32) -> None:
    # Each stops at this share of what the first guess leaves, which is less than all that bounces;
    # and float32 sums of some ten terms.
    bounced = np.abs(at_once - own).max()
    np.testing.assert_allclose(found, at_once, rtol=1e-6, atol=2.0 * RESIDUAL * bounced)


@pytest.mark.parametrize("number", range(8))
def test_the_sun_between_solved_directions_is_the_sun_solved_there(number: int) -> None:
    direction = directions(8)[number]
    transport, asked = open_box(), response()
    surface = reflectors(transport, white(0.8))
    cosines = SunlitPatches(transport).cosines(direction)
    own = surface.albedo * (cosines[:, None] * SUNLIGHT).astype(np.float32)
    agree(asked.of_sun(direction, SUNLIGHT), radiosity(transport, surface, own), own)


def test_the_sky_by_cells_is_the_sky_at_once() -> None:
    transport = open_box()
    surface = reflectors(transport, white(0.8))
    own = surface.albedo * (transport.sky @ (np.float32(np.pi) * cells()))
    agree(response().of_sky(cells()), radiosity(transport, surface, own), own)


def test_lights_add_up() -> None:
    """Sun, sky, lamps and what glows, each by itself, are all of them solved together."""
    transport, direction = open_box(), directions(9)[8]
    asked = response(emission=5.0)
    surface = reflectors(transport, white(0.8, emission=5.0))
    random = np.random.default_rng(5)
    lamps: Array32 = random.uniform(0.0, 9.0, len(transport.areas)).astype(np.float32)
    sun = SunlitPatches(transport).cosines(direction)[:, None] * SUNLIGHT
    irradiance = sun.astype(np.float32) + lamps[:, None]
    irradiance += transport.sky @ (np.float32(np.pi) * cells())
    own = surface.exitance + surface.albedo * irradiance
    found = (
        asked.glow
        + asked.of_sun(direction, SUNLIGHT)
        + asked.of_fields({"lamps": lambda: lamps})["lamps"]
    )
    agree(found + asked.of_sky(cells()), radiosity(transport, surface, own), own)


def test_fields_of_light_are_solved_by_their_name_once() -> None:
    transport, asked = open_box(), response()
    surface = reflectors(transport, white(0.8))
    random = np.random.default_rng(6)
    first, second = random.uniform(0.0, 9.0, (2, len(transport.areas))).astype(np.float32)
    dark = np.zeros_like(first)
    found = asked.of_fields({"one": lambda: first, "none": lambda: dark})
    found |= asked.of_fields({"one": lambda: second, "two": lambda: second})
    for name, field in (("one", first), ("two", second)):
        own = surface.albedo * field[:, None]
        np.testing.assert_array_equal(found[name], radiosity(transport, surface, own))
    assert not found["none"].any()


def test_what_was_asked_before_changes_no_bit() -> None:
    """Directions that share one, two and three of the lattice's, and some far away between."""
    start = directions(5)[4]
    near = [start + 0.004 * k * np.array([1.0, -0.3, 0.2]) for k in range(6)]
    asked = [d / np.linalg.norm(d) for d in (*near, *directions(8))]
    one, other = response(), response()
    in_order = [one.of_sun(d, SUNLIGHT) for d in asked]
    backwards = [other.of_sun(d, SUNLIGHT) for d in asked[::-1]][::-1]
    for a, b in zip(in_order, backwards, strict=True):
        np.testing.assert_array_equal(a, b)


def test_what_is_kept_is_bounded() -> None:
    asked = response()
    for direction in directions(40):
        asked.of_sun(direction, SUNLIGHT)
    assert len(asked._nodes.values()) == 64


def test_a_direction_stored_late_does_not_evict_one_that_is_needed() -> None:
    """Neighbours share directions of the grid; here no more are stored than one of them needs."""
    asked = response()
    asked._nodes = LruCache(3)
    for step in np.linspace(0.0, 0.03, 30):
        direction = np.array([0.4 + step, 0.3 - 0.6 * step, 0.3])
        asked.of_sun(direction / np.linalg.norm(direction), SUNLIGHT)
