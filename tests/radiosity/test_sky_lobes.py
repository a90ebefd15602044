"""Light of the Earth leaves glossy surfaces in lobes: what a wall gets, against the law."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.arrays import Array
from simgl.environment_map import SkyRadiance, cube_directions, cube_solid_angles
from simgl.radiosity.precomputed_response import GatheredSunlight, PrecomputedResponse
from simgl.radiosity.reflection_laws import hemispherical_albedo
from simgl.radiosity.solver import reflectors, vertex_irradiance
from simgl.radiosity.sunlit_patches import SunlitPatches
from simgl.scene.materials import Material
from tests.radiosity.glossy_walls import (
    BLACK,
    PAINTS,
    PLATE,
    SMOOTH_GLASS,
    WALL,
    WIDE,
    baked,
    law,
    mean_of_parts,
    midpoints,
    of_wall,
    part_of,
)

# Of the Earth, from 550 km.
HALF_ANGLE = np.radians(67.0)
FINE = 16


def response(material: Material) -> PrecomputedResponse:
    transport = baked(WALL)
    surface = reflectors(transport, [material, BLACK])
    return PrecomputedResponse(transport, surface, SunlitPatches(transport))


def of_earth(material: Material, nadir: Array) -> Array:
    """(16, 4) mean irradiance of the parts of the wall by the plate, an Earth of radiance 1."""
    transport, solved = baked(WALL), response(material)
    bright = cube_directions(64) @ nadir > np.cos(HALF_ANGLE)
    sky = np.repeat(bright[..., None], 4, axis=3).astype(np.float32)
    cells = transport.cells_of(SkyRadiance(radiance=sky))
    lobes = None if solved.sky_lobes is None else solved.sky_lobes.at_points(cells)
    vertices = vertex_irradiance(transport.of_vertices, solved.of_sky(cells), None, lobes)
    assert transport.grids is not None
    nodes = np.zeros((transport.grids.rows, 4), dtype=np.float32)
    return of_wall(transport, GatheredSunlight(vertices=vertices, nodes=nodes)).of_parts(WALL)


def by_quadrature(material: Material, nadir: Array) -> tuple[Array, Array]:
    """The same by the law, and of a matt plate of the same albedo."""
    at, areas, normal = midpoints(WALL, 8)
    places, patches, up = midpoints(PLATE, 16, 2.0)
    directions = cube_directions(FINE).reshape(-1, 3)
    angles = np.tile(cube_solid_angles(FINE).ravel(), 6)
    chosen = (directions @ nadir > np.cos(HALF_ANGLE)) & (directions[:, 2] > 0.0)
    directions, angles = directions[chosen], angles[chosen]
    light, evenly = np.zeros((len(at), 4)), np.zeros(len(at))
    for place, patch in zip(places, patches, strict=True):
        # Where they meet the wall's plane, and whether that is on the wall.
        with np.errstate(divide="ignore"):
            met = place + np.maximum(-place[0] / directions[:, :1], 0.0) * directions
        hidden = (directions[:, 0] < 0.0) & (np.abs(met[:, 1]) < 1.0) & (met[:, 2] < 1.5)
        come, arriving = directions[~hidden], (angles * directions[:, 2])[~hidden]
        go = at - place
        forms = (go @ up) * -(go @ normal) / np.sum(go**2, axis=1) ** 2 * patch
        go /= np.linalg.norm(go, axis=1)[:, None]
        for k, form in enumerate(forms):
            light[k] += form * (arriving @ law(material, up, come, np.tile(go[k], (len(come), 1))))
        evenly += forms * arriving.sum() / np.pi
    part = part_of(at, WALL)
    even = evenly[:, None] * hemispherical_albedo(material)
    return mean_of_parts(light, areas, part), mean_of_parts(even, areas, part)


@pytest.mark.parametrize("name", ["alpha 0.2", "alpha 0.64"])
@pytest.mark.parametrize("nadir", [(1.0, 0.0, 1.0), (1.0, 0.0, 0.0), (-1.0, 0.0, 1.0)])
def test_light_of_the_earth_leaves_metal_by_the_law(
    name: str, nadir: tuple[float, float, float]
) -> None:
    """A matt plate sends a wall 61 % too little of an Earth before it, twice as much of one behind
    it. Cells of 22 deg leave a fifth of that, and parts within 0.02 of an Earth all around."""
    direction = np.array(nadir) / np.linalg.norm(nadir)
    true, matt = by_quadrature(WIDE[name], direction)
    seen = of_earth(WIDE[name], direction)
    total, of_matt = true.mean(axis=0), matt.mean(axis=0)
    assert np.all(np.abs(of_matt - total) > 0.14 * total)
    assert np.all(np.abs(seen.mean(axis=0) - total) < 0.2 * np.abs(of_matt - total))
    assert np.abs(seen - true).max() < 0.02 * np.pi


@pytest.mark.parametrize("material", [*WIDE.values(), *PAINTS.values()])
def test_what_leaves_by_a_sky_alike_all_around_is_the_albedo(material: Material) -> None:
    """Below the plate, where nothing hides it: but for 48 directions in place of a hemisphere."""
    transport, solved = baked(WALL), response(material)
    assert solved.sky_lobes is not None
    below = (transport.normals.mean(axis=1)[:, 2] < -0.9) & (transport.materials[:, 0] == 1.0)
    albedo = reflectors(transport, [material, BLACK]).albedo
    leaving = solved.sky_lobes.leaving(albedo).sum(axis=2)
    assert below.any()
    # Fresnel's law of smooth glass rises within the cells along the horizon.
    smooth = material is PAINTS[SMOOTH_GLASS]
    np.testing.assert_allclose(leaving[below], np.pi * albedo[below], rtol=0.06 if smooth else 0.02)
