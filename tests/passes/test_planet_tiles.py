"""No pixel of the Earth or its air falls outside the tiles that draw it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from simgl.physics.air_profile import AIR_TOP
from simgl.physics.atmosphere import STANDARD
from simgl.scene.earth import Earth
from simgl.view.background import PlanetView
from simgl.view.background_tiles import TILE, ground_tiles
from tests.passes.air_scenes import axes

Array = np.ndarray[Any, Any]

SIZE = (200, 150)


def looking(height: float, off_nadir: float, focal: float) -> tuple[PlanetView, Array]:
    """From a height [m] over 40 deg north; focal length [pixels]."""
    earth = Earth(air=STANDARD)
    radii = np.array(earth.radii)
    up = np.array([np.cos(0.7), 0.0, np.sin(0.7)])
    in_sphere = up * (1.0 + height / radii[0])
    a = np.radians(off_nadir)
    R = axes(-np.cos(a) * up + np.sin(a) * np.array([0.0, 0.6, 0.8]))
    view = PlanetView(
        earth=earth,
        sphere_from_camera=((radii[0] / radii)[:, None] * R.T).astype(np.float32),
        camera_in_sphere=in_sphere.astype(np.float32),
        outside=float(in_sphere @ in_sphere) - 1.0,
        sun_direction_itrf=up.astype(np.float32),
        sun_irradiance=np.ones(4, np.float32),
    )
    return view, np.array([[focal, 0, 100], [0, focal, 75], [0, 0, 1]], np.float32)


@pytest.mark.parametrize("height", [2.0, 5e4, 4e5, 3.6e7])
@pytest.mark.parametrize("off_nadir", [0.0, 8.0, 69.0, 88.0, 120.0, 180.0])
@pytest.mark.parametrize("focal", [100.0, 700.0])
def test_ground_and_air_lie_inside_their_tiles(
    height: float, off_nadir: float, focal: float
) -> None:
    planet, k = looking(height, off_nadir, focal)
    y, x = np.mgrid[: SIZE[1], : SIZE[0]] + 0.5
    rays = np.stack([(x - k[0, 2]) / focal, (y - k[1, 2]) / focal, np.ones_like(x)], axis=-1)
    d = rays @ planet.sphere_from_camera.astype(np.float64).T
    od = d @ planet.camera_in_sphere.astype(np.float64)
    dd = np.sum(d * d, axis=-1)
    on_ground = (od < 0.0) & (od * od > dd * planet.outside)
    reach = (1.0 + AIR_TOP / planet.earth.equatorial_radius) ** 2 - 1.0
    in_air = (planet.outside < reach) | ((od < 0.0) & (od * od > dd * (planet.outside - reach)))
    tiles = ground_tiles(planet, [planet.sphere_from_camera], k, SIZE).in_light_of(
        planet.sun_direction_itrf
    )

    def pixels(mask: Array) -> Array:
        return mask[0].repeat(TILE, axis=0).repeat(TILE, axis=1)[: SIZE[1], : SIZE[0]]

    assert not (tiles.even & tiles.finer).any()
    even, ground, air = pixels(tiles.even | tiles.finer), pixels(tiles.ground), pixels(tiles.air)
    assert (even.astype(int) + ground + air).max() <= 1
    assert np.all((even | ground)[on_ground])
    assert np.all(on_ground[even])
    assert np.all((even | ground | air)[in_air])
