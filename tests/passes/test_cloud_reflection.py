"""How clouds distribute their light: energy, reciprocity, photons; and ice in winter."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.interpolate import RegularGridInterpolator

from simgl import assets
from tests.passes.test_ground import RADIUS, SUN, looking_down, tilted_sun
from tools.cloud_reflection import (
    CELLS,
    ROUGH,
    THICKNESSES,
    bidirectional,
    henyey_greenstein,
    rough,
)

Array = np.ndarray[Any, Any]

COSINES = (np.arange(CELLS) + 0.5) / CELLS


@pytest.fixture(scope="module")
def table() -> Array:
    return np.asarray(np.load(assets.data() / "earth" / "cloud_reflection.npy"))


def over_hemisphere(values: Array) -> Array:
    """Mean over views weighted by their cosine; values : (azimuth, view, ...)."""
    around = np.full(CELLS, 1.0 / (CELLS - 1))
    around[[0, -1]] *= 0.5
    weights = COSINES / COSINES.sum()
    return np.asarray(np.einsum("a,v,av...->...", around, weights, values))


def test_clouds_send_away_what_they_reflect(table: Array) -> None:
    """The mean over views is 1 but for what 16 cells miss of the peak along a low Sun."""
    mean = over_hemisphere(table)
    np.testing.assert_allclose(mean[4:], 1.0, atol=0.03)
    np.testing.assert_allclose(mean[1:4], 1.0, atol=0.12)


def test_sun_and_camera_can_change_places(table: Array) -> None:
    """Helmholtz: the reflectance factor of a layer, here times its albedo, is symmetric."""
    for thickness in range(len(THICKNESSES)):
        of_layer = table[2:, 4:, 4:, thickness]
        # The albedo by which each Sun's column was divided, up to one factor.
        albedo = np.ones(CELLS - 4)
        for _ in range(50):
            ratio = of_layer * albedo
            albedo *= np.sqrt((ratio.transpose(0, 2, 1) / ratio).mean(axis=(0, 1)))
        symmetric = of_layer * albedo
        np.testing.assert_allclose(symmetric, symmetric.transpose(0, 2, 1), rtol=0.02)


def photons(thickness: float, cosine: float, count: int) -> Array:
    """(n, 3) directions in which photons leave a layer's top; they came along x and down."""
    rng = np.random.default_rng(5)
    cosines = np.linspace(-1.0, 1.0, 20_001)
    phase = henyey_greenstein(cosines)
    share = np.concatenate([[0.0], np.cumsum(phase[1:] + phase[:-1])])
    direction = np.tile([np.sqrt(1.0 - cosine**2), 0.0, -cosine], (count, 1))
    depth, out = np.zeros(count), []
    while len(direction):
        depth = depth - rng.exponential(size=len(depth)) * direction[:, 2]
        out.append(direction[depth < 0.0])
        inside = (depth > 0.0) & (depth < thickness)
        direction, depth = direction[inside], depth[inside]
        c = np.interp(rng.random(len(depth)), share / share[-1], cosines)
        turn = rng.uniform(0.0, 2.0 * np.pi, len(depth))
        aside = np.cross(direction, [0.0, 1.0, 0.0])
        aside /= np.linalg.norm(aside, axis=1)[:, None]
        other = np.cross(direction, aside)
        s = np.sqrt(1.0 - c**2)
        direction = c[:, None] * direction + (s * np.cos(turn))[:, None] * aside
        direction += (s * np.sin(turn))[:, None] * other
    return np.concatenate(out)


def test_doubling_agrees_with_photons() -> None:
    """A layer of thickness 3 under a Sun at 0.53: its albedo, and light ahead, aside and behind."""
    azimuths = np.linspace(0.0, np.pi, 61)
    reflectance, mu, weights = bidirectional(3.0, azimuths, henyey_greenstein)
    sun, count = int(np.argmin(abs(mu - 0.53))), 60_000
    out = photons(3.0, float(mu[sun]), count)
    turns = np.arctan2(np.abs(out[:, 1]), out[:, 0])
    around = np.full(61, 1.0 / 60.0)
    around[[0, -1]] *= 0.5
    for low, high in (0.0, np.pi), (0.0, 0.6), (1.2, 2.0), (2.5, np.pi):
        inside = (azimuths >= low - 1e-9) & (azimuths <= high + 1e-9)
        share = around * inside
        share *= (high - low) / np.pi / share.sum()
        sent = 2.0 * np.einsum("a,v,av->", share, weights * mu, reflectance[:, :, sun])
        counted = int(((turns >= low) & (turns <= high)).sum())
        # Four standard deviations of the count, and what steps of the azimuth leave.
        assert counted / count == pytest.approx(sent, rel=4.0 / np.sqrt(counted) + 0.02)


@pytest.fixture(scope="module")
def white() -> RegularGridInterpolator:
    """A white Lambertian layer."""
    cosines = np.linspace(0.002, 0.998, 3)
    return RegularGridInterpolator(
        (np.linspace(0.0, np.pi, 3), cosines, cosines), np.ones((3,) * 3)
    )


def test_rough_tops_under_a_high_sun_are_dimmed_by_the_mean_of_their_cosine(
    white: RegularGridInterpolator,
) -> None:
    """Seen from the Sun: facets of slope squared t, spread like exp(-t / m), show 1 / cos of the
    level area, of which each sends cos^2."""
    straight = np.full(1, 0.9999)
    seen = float(rough(white, np.array([np.pi]), straight, straight)[0])
    mean, _ = quad(lambda x: np.exp(-x) / np.sqrt(1.0 + ROUGH * x), 0.0, 40.0)
    # Nodes of Laguerre's rule, and cosines that end at 0.998.
    assert seen == pytest.approx(mean, rel=0.004)


def test_rough_tops_send_more_of_a_low_sun_back_than_ahead(white: RegularGridInterpolator) -> None:
    """Camera and Sun can change places, too."""
    ahead_and_back, low, slant = np.array([0.0, np.pi]), np.full(2, 0.4), np.full(2, 0.6)
    ahead, back = rough(white, ahead_and_back, slant, low)
    assert back > 1.5 * ahead
    np.testing.assert_allclose(rough(white, ahead_and_back, low, slant), (ahead, back), rtol=1e-12)


def test_ice_comes_in_winter(gl: moderngl.Context) -> None:
    """Straight down on Hudson Bay: white in March; in September the sea."""
    place = (60.0, -85.0)
    sun = tilted_sun(place, 60.0, 180.0)
    earth = {"shape": "sphere", "radius_km": RADIUS, "clouds": {"cover": 0.0}}
    seen = []
    for frozen in (True, False):
        image = looking_down(gl, place, sun, earth | {"ice_and_snow": frozen}, width=100.0)
        seen.append(np.pi * image.mean(axis=(0, 1)) / SUN / np.cos(np.radians(60.0)))
    # The scenes' date is 20 March: dry snow over all but a thirtieth of the bay.
    np.testing.assert_allclose(seen[0], 0.97 * np.array([0.80, 0.81, 0.82, 0.70]), atol=0.04)
    assert np.all(seen[1] < 0.1)
