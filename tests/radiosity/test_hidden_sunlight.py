"""Sunlight between surfaces, where other spacecraft take the Sun's light from them."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.arrays import Array
from simgl.radiosity.incident_light import IncidentLight, Neighbour
from simgl.radiosity.patch_light import PatchLight
from simgl.radiosity.precomputed_response import GatheredSunlight
from simgl.scene.materials import Material
from simgl.scene.spacecraft import SpacecraftModel
from tests.radiosity.glossy_walls import BLACK, WALL, WIDE, baked, by_quadrature, of_wall, towards
from tests.radiosity.shapes import Quad, quads

SUN = towards(45.0, 40.0)
MATT = Material(name="matt", reflectance=(0.8,) * 4)


def sheet(half: float) -> Quad:
    """A square at the origin."""
    return ((-half, -half, 0.0), (half, -half, 0.0), (half, half, 0.0), (-half, half, 0.0))


def model(name: str, quad_corners: tuple[Quad, ...], *materials: Material) -> SpacecraftModel:
    return SpacecraftModel(
        name=name,
        mesh=quads(quad_corners),
        parts=(name,),
        materials=materials,
        open_sheets=True,
    )


def plate_and_wall(
    plate: Material, wall: Material, shade: tuple[Quad, Array] | None
) -> tuple[SpacecraftModel, IncidentLight]:
    """A body in the Sun, of ``baked(WALL)``.

    shade : a sheet before the Sun, and where it is
    """
    body = model("plate and wall", (WALL, WALL), plate, wall)
    before: tuple[Neighbour, ...] = ()
    if shade is not None:
        pose = np.eye(4)
        pose[:3, 3] = -shade[1]
        other = model("shade", (shade[0],), BLACK)
        before = (Neighbour(instance=2, model=other, other_from_body=pose, near=True),)
    incident = IncidentLight(
        sun_direction=SUN,
        sun_irradiance=np.full(4, 100.0),
        before_sun=before,
        lamps=(),
        around=before,
    )
    return body, incident


def lit(plate: Material, wall: Material, shade: tuple[Quad, Array] | None) -> GatheredSunlight:
    """What a plate with a wall gets of its own surfaces in the Sun."""
    body, incident = plate_and_wall(plate, wall, shade)
    besides = PatchLight().besides_sky(body, baked(WALL), incident)
    assert besides is not None
    assert isinstance(besides.sunlight, GatheredSunlight)
    return besides.sunlight


@pytest.mark.parametrize("plate", [WIDE["alpha 0.2"], MATT], ids=["metal", "matt"])
def test_a_body_in_full_shadow_of_another_reflects_no_sunlight(plate: Material) -> None:
    """In lobes or evenly. Light of lobes less what would be missing of even light leaves a
    third."""
    free = lit(plate, BLACK, None)
    assert free.vertices.max() > 10.0
    assert np.abs(free.nodes).max() > 0.1
    hidden = lit(plate, BLACK, (sheet(20.0), 4.0 * SUN))
    assert hidden.vertices.max() < 1e-4
    assert np.abs(hidden.nodes).max() < 1e-4


@pytest.mark.parametrize("name", ["alpha 0.2", "alpha 0.4"])
def test_what_is_hidden_of_a_metal_plate_is_missing_where_its_lobes_would_send_it(
    name: str,
) -> None:
    """A sheet shades the plate beside the middle of the wall. Against quadrature of the law over
    the sunlit rest, in shares of what each part of the wall gets without the sheet."""
    half, height, middle = 0.4, 0.5, np.array([0.6, 0.2, 0.0])
    shift = middle + SUN * (height / SUN[2])

    def seen_by_the_sun(places: Array) -> Array:
        return np.asarray(np.any(np.abs(places - middle)[:, :2] > half, axis=1))

    free = by_quadrature(WIDE[name], WALL, SUN)
    true = by_quadrature(WIDE[name], WALL, SUN, seen_by_the_sun)
    transport = baked(WALL)
    whole, left = (
        of_wall(transport, lit(WIDE[name], BLACK, shade)).of_parts(WALL)
        for shade in (None, (sheet(half), shift))
    )
    bright = free > 0.1 * free.max(axis=0)
    np.testing.assert_allclose((left / whole)[bright], (true / free)[bright], atol=0.1)
    np.testing.assert_allclose(left.sum() / whole.sum(), true.sum() / free.sum(), atol=0.03)


def test_half_a_shadow_takes_light_of_what_it_covers() -> None:
    """Vertices lose no more than all, gain nothing, and those far from the shadow keep theirs."""
    free = lit(MATT, BLACK, None).vertices
    # Over the far end of the plate.
    part = lit(MATT, BLACK, (sheet(0.4), 0.5 * SUN + [1.6, 0.6, 0.0])).vertices
    assert np.all(part <= free * 1.0001)
    assert np.all(part >= 0.0)
    total = part.sum() / free.sum()
    assert 0.7 < total < 0.99
