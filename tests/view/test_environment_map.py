"""The cube of radiance around a spacecraft, and what surfaces get of it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from simgl.environment_map import (
    COARSE,
    DOWN,
    FINE,
    FORWARD,
    RIGHT,
    SkyRadiance,
    cell_radiance,
    cube_directions,
    cube_solid_angles,
    irradiance,
    octahedron,
    turned,
    with_borders,
)
from simgl.glossy_sky import ROUGHNESS, prefiltered

Array = np.ndarray[Any, np.dtype[Any]]

N = 128


def sky_of(values: Array) -> SkyRadiance:
    """A sky with (6, n, n) radiance in every band."""
    return SkyRadiance(radiance=np.repeat(values[..., None], 4, axis=3).astype(np.float32))


def test_solid_angles_of_a_cube_sum_to_the_sphere() -> None:
    for n in (1, 2, 7, N):
        np.testing.assert_allclose(6.0 * cube_solid_angles(n).sum(), 4.0 * np.pi, rtol=1e-12)
    # Next to a face's middle: (2 / n)^2 times 1 - 3 r^2 / 2, with r^2 = 8 / (3 n^2) on average.
    expected = 4.0 / N**2 * (1.0 - 4.0 / N**2)
    np.testing.assert_allclose(cube_solid_angles(N)[64, 64], expected, rtol=1e-6)


def test_directions_follow_the_cube_maps_of_opengl() -> None:
    """Specification of OpenGL 3.3, table 3.19: major axis, then s and t from the other two."""
    d = cube_directions(4)
    table = {0: "-z -y", 1: "+z -y", 2: "+x +z", 3: "+x -z", 4: "+x -y", 5: "-x -y"}
    for face, text in table.items():
        for j, i in ((0, 3), (2, 1)):
            vector = d[face, j, i] / np.abs(d[face, j, i]).max()
            for name, value in zip(text.split(), (i, j), strict=True):
                component = vector["xyz".index(name[1])] * (1.0 if name[0] == "+" else -1.0)
                np.testing.assert_allclose(component, (2.0 * value + 1.0) / 4.0 - 1.0)
            assert vector[face // 2] == (1.0, -1.0)[face % 2]


def test_borders_are_the_texels_of_the_neighbouring_faces() -> None:
    n = 8
    sky = np.random.default_rng(3).random((6, n, n, 4)).astype(np.float32)
    around = with_borders(sky)
    np.testing.assert_array_equal(around[:, 1:-1, 1:-1], sky)
    # Directions of a cube whose faces are wider by a texel on each side.
    t = (2.0 * np.arange(-1, n + 1) + 1.0) / n - 1.0
    wider = FORWARD[:, None, None] + DOWN[:, None, None] * t[:, None, None]
    wider = wider + RIGHT[:, None, None] * t[:, None]
    wider /= np.linalg.norm(wider, axis=-1, keepdims=True)
    nearness = wider @ cube_directions(n).reshape(-1, 3).T
    corner = np.zeros((n + 2, n + 2), dtype=bool)
    corner[np.ix_([0, -1], [0, -1])] = True
    nearest = sky.reshape(-1, 4)[nearness.argmax(axis=-1)]
    np.testing.assert_array_equal(around[:, ~corner], nearest[:, ~corner])
    # The three texels that meet in a corner are the nearest to it.
    three = np.argsort(nearness[:, corner], axis=-1)[..., -3:]
    mean = sky.reshape(-1, 4)[three].mean(axis=-2)
    np.testing.assert_allclose(around[:, corner], mean, rtol=1e-6)


def test_an_octahedral_map_is_continuous_across_its_fold_and_has_the_axes() -> None:
    d = octahedron(COARSE)
    np.testing.assert_allclose(np.linalg.norm(d, axis=2), 1.0)
    # Each of the square's edges is folded about its middle.
    for edge in (d[0], d[-1], d[:, 0], d[:, -1]):
        np.testing.assert_allclose(edge, edge[::-1], atol=1e-12)
    points = {tuple(np.round(v, 12) + 0.0) for v in d.reshape(-1, 3)}
    for axis in np.concatenate([np.eye(3), -np.eye(3)]):
        assert tuple(axis) in points


def test_a_uniform_sky_gives_pi_on_every_plane_and_one_in_every_lobe() -> None:
    sky = sky_of(np.ones((6, N, N)))
    plane = irradiance(sky)
    # Texel centres stand for texels: 1 / n^2 = 6e-5 at most.
    np.testing.assert_allclose(plane, np.pi, rtol=6e-5)
    np.testing.assert_allclose(prefiltered(sky, plane), 1.0, rtol=6e-5)
    np.testing.assert_allclose(cell_radiance(sky), 1.0, rtol=1e-5)


def test_irradiance_is_the_sum_over_texels() -> None:
    """A random sky of 24-degree patches with sharp edges, against the plain sum."""
    rng = np.random.default_rng(2)
    values = np.kron(rng.random((6, 4, 4)) ** 4, np.ones((32, 32)))
    got = irradiance(sky_of(values))[..., 0]
    weighted = (values * cube_solid_angles(N)).ravel()
    heights = cube_directions(N).reshape(-1, 3) @ octahedron(COARSE).reshape(-1, 3).T
    expected = (weighted @ np.maximum(heights, 0.0)).reshape(COARSE, COARSE)
    # Blocks that a plane cuts (6 degrees) are taken as uniform, which these are; float32 sums.
    np.testing.assert_allclose(got, expected, rtol=1e-5)


def test_irradiance_along_the_body_axes_is_exact_for_any_sky() -> None:
    values = np.random.default_rng(3).random((6, N, N))
    got = irradiance(sky_of(values))[..., 0]
    weighted = values * cube_solid_angles(N)
    middle, last = COARSE // 2, COARSE - 1
    places = [(middle, last), (middle, 0), (last, middle), (0, middle), (middle, middle), (0, 0)]
    for face, place in enumerate(places):
        axis = (1.0, -1.0)[face % 2] * np.eye(3)[face // 2]
        expected = np.sum(weighted * np.maximum(cube_directions(N) @ axis, 0.0))
        # float32 sums of 98 k texels in blocks
        np.testing.assert_allclose(got[place], expected, rtol=1e-6)


@pytest.mark.parametrize("level", range(len(ROUGHNESS)))
@pytest.mark.parametrize("zenith", [(0.0, 0.0, 1.0), (0.36, 0.48, 0.8)])
def test_lobes_see_a_half_lit_sky_as_their_ggx_weights_say(
    level: int, zenith: tuple[float, float, float]
) -> None:
    """Light from above a horizon only, against quadrature of D(h) max(n.l, 0) about each axis."""
    sky = sky_of((cube_directions(N) @ zenith > 0.0).astype(float))
    seen = prefiltered(sky, irradiance(sky))[level, ::4, ::4, 0]
    height = octahedron(FINE)[::4, ::4] @ zenith
    alpha = ROUGHNESS[level] ** 2
    # Half vectors on a grid that is even in D cos(theta_h); dl = 4 cos(theta_h) dh makes it even in
    # D dl too.
    u = (np.arange(1000) + 0.5) / 1000.0
    theta = 2.0 * np.arcsin(np.sqrt(alpha**2 * u / (1.0 - u + alpha**2 * u)))
    phi = (np.arange(200) + 0.5) * (2.0 * np.pi / 200.0)
    weight = np.maximum(np.cos(theta), 0.0)
    expected = np.zeros_like(height)
    for place, h in np.ndenumerate(height):
        side = np.sqrt(max(1.0 - h**2, 0.0)) * np.cos(phi)
        lit = np.cos(theta)[:, None] * h + np.sin(theta)[:, None] * side > 0.0
        expected[place] = np.sum(weight * lit.mean(axis=1)) / weight.sum()
    # A block that the horizon cuts is spread evenly over itself: 0.35 of the lobe's scale (0.5 for
    # the smoothest), a few of which lie along the horizon. Measured: 0.011 at most.
    np.testing.assert_allclose(seen, expected, atol=0.012)


def test_cells_are_means_of_their_blocks() -> None:
    values = np.random.default_rng(4).random((6, N, N))
    got = cell_radiance(sky_of(values), 4)[:, 0]
    weighted, solid_angle = values * cube_solid_angles(N), cube_solid_angles(N)
    for face, row, column in ((0, 0, 0), (3, 2, 1), (5, 3, 3)):
        block = np.s_[32 * row : 32 * row + 32, 32 * column : 32 * column + 32]
        expected = weighted[face][block].sum() / solid_angle[block].sum()
        np.testing.assert_allclose(got[16 * face + 4 * row + column], expected, rtol=1e-5)


def test_a_turned_sky_has_its_light_where_it_was() -> None:
    a, b = (np.array(v) / np.linalg.norm(v) for v in ([0.3, -0.5, 0.8], [-0.6, 0.7, 0.2]))
    bands = np.stack([a, b, a + b, a - b])
    sky = SkyRadiance(radiance=(2.0 + cube_directions(N) @ bands.T).astype(np.float32))
    # A quarter about two axes each, so that neither the sense nor the order can be mistaken.
    R_sky_from_body = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    angle = 0.4
    c, s = np.cos(angle), np.sin(angle)
    R_sky_from_body = R_sky_from_body @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    found = turned(sky, R_sky_from_body).radiance
    expected = 2.0 + cube_directions(64) @ R_sky_from_body.T @ bands.T
    # Half a diagonal of a texel, 1 / 64 wide on each side of its middle; |a - b| is below 2.
    assert np.abs(found - expected).max() < 2.0 * np.sqrt(2.0) / 64.0
    # Cells are means of 256 texels, each off by up to 0.044: 3.5 standard errors of 1.6e-3.
    there = cell_radiance(SkyRadiance(radiance=expected.astype(np.float32)))
    cells = cell_radiance(turned(sky, R_sky_from_body))
    assert np.abs(cells - there).max() < 6e-3


def test_a_sky_of_another_shape_is_refused() -> None:
    with pytest.raises(ValueError, match=r"n a multiple of 64, got \(6, 32, 32, 4\)"):
        sky_of(np.ones((6, 32, 32)))
