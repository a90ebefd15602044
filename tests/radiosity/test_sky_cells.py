"""The few cells of a body's sky: planes get of them what they get of the sky itself."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.arrays import Array, Array32
from simgl.environment_map import SkyRadiance, cell_radiance, cube_directions, cube_solid_angles
from simgl.radiosity.hemisphere import CELLS_ACROSS
from simgl.radiosity.sky_cells import sky_cells

N = 64


def earth(nadir: Array) -> SkyRadiance:
    """A disc of 70 deg, brighter in the middle and in two of the bands; black around it."""
    cosine = cube_directions(N) @ nadir
    light = np.where(cosine > np.cos(np.radians(70.0)), 0.3 + 0.7 * cosine, 0.0)
    return SkyRadiance(
        radiance=(light[..., None] * np.array([100.0, 50.0, 0.0, 100.0])).astype(np.float32)
    )


def plane_irradiance(radiance: Array32, across: int) -> Array:
    """(k, 4) of planes by radiance (6 n^2, 4) of cells, the cosine by directions much finer."""
    rng = np.random.default_rng(5)
    normals = rng.normal(size=(200, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    directions = cube_directions(N).reshape(-1, 3)
    area = np.tile(cube_solid_angles(N).ravel(), 6)
    of_texels = radiance.reshape(6, across, across, 4).repeat(N // across, 1).repeat(N // across, 2)
    return np.maximum(normals @ directions.T, 0.0) * area @ of_texels.reshape(-1, 4)


@pytest.mark.parametrize("nadir", [(0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (-0.48, 0.6, 0.64)])
def test_planes_get_of_the_cells_what_they_get_of_the_sky(nadir: tuple[float, ...]) -> None:
    sky = earth(np.array(nadir))
    wanted = plane_irradiance(sky.radiance.reshape(-1, 4), N)
    cells, means = sky_cells(sky), cell_radiance(sky, CELLS_ACROSS)
    largest = wanted.max(axis=0)[[0, 1, 3]]
    errors = [
        np.abs(plane_irradiance(one, CELLS_ACROSS) - wanted)[:, [0, 1, 3]] / largest
        for one in (cells, means)
    ]
    # The limb runs through cells of 22 deg: their means leave 2 to 3 %.
    assert errors[0].max() < 0.012
    assert errors[0].max() < 0.6 * errors[1].max()


def test_what_is_dark_stays_dark_and_an_even_sky_even() -> None:
    sky = earth(np.array([0.0, 0.0, 1.0]))
    cells, means = sky_cells(sky), cell_radiance(sky, CELLS_ACROSS)
    assert np.all(cells >= 0.0)
    assert np.all(cells[means == 0.0] == 0.0)
    even = SkyRadiance(radiance=np.full((6, N, N, 4), 7.0, dtype=np.float32))
    # float32 through some thirty rounds of two products.
    np.testing.assert_allclose(sky_cells(even), 7.0, rtol=2e-5)
