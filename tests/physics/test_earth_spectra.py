"""Spectra of ground and clouds in bands of a scenario."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.physics.earth_spectra import (
    CLOUD_PLACES,
    cloud_table,
    ice_cloud,
    land_in_bands,
    leaf_reflectance,
    snow_reflectance,
    two_streams,
    water_mirror,
)
from simgl.physics.spectral_form import scaled
from simgl.physics.spectrum import BANDS, Bands

R_G_B_N = Bands(names=("w", "x", "y", "z"))
LAND = np.array(
    [[0.45, 0.29, 0.16, 0.5], [0.03, 0.05, 0.02, 0.3], [0.85, 0.85, 0.85, 0.7]], dtype=np.float32
)


def _bands(*edges_nm: tuple[float, float]) -> Bands:
    names = tuple("abcd"[: len(edges_nm)])
    return Bands(names=names, edges=tuple((low * 1e-9, high * 1e-9) for low, high in edges_nm))


def test_land_in_bands_that_are_r_g_b_n_is_the_map() -> None:
    np.testing.assert_allclose(land_in_bands(LAND, R_G_B_N), LAND, rtol=1e-5)
    snow = scaled((0.8, 0.81, 0.82, 0.7), leaf_reflectance, R_G_B_N)
    np.testing.assert_allclose(snow, (0.8, 0.81, 0.82, 0.7), rtol=1e-12)
    assert BANDS != R_G_B_N


def test_leaves_snow_and_sand_have_their_marks_in_the_infrared() -> None:
    edge, near, water, short = land_in_bands(
        LAND, _bands((660, 680), (840, 860), (1440, 1460), (1640, 1660))
    ).T
    sand, leaves, snow = 0, 1, 2
    # Red edge; water within the leaves; snow grows dark, sand does not.
    assert near[leaves] > 6.0 * edge[leaves]
    assert water[leaves] < 0.5 * short[leaves] < 0.5 * near[leaves]
    assert short[snow] < 0.2 * near[snow]
    assert short[sand] > 1.1 * near[sand]


# Snow of 100 um, for light from all sides (Wiscombe and Warren 1980, J. Atmos. Sci. 37, 2712,
# figure 8, read to 0.03).
@pytest.mark.parametrize(("nm", "albedo"), [(500, 0.99), (900, 0.90), (1500, 0.05), (1800, 0.22)])
def test_snow_has_the_published_albedo(nm: float, albedo: float) -> None:
    got = float(snow_reflectance(np.array([float(nm)]), 100e-6)[0])
    assert got == pytest.approx(albedo, abs=0.05)


def test_a_cloud_in_visible_light_is_the_default_s_and_grows_dark_beyond_1400_nm() -> None:
    table = cloud_table(_bands((600, 700), (1630, 1660), (2100, 2160)))
    reflected, lost = table
    # By 0.1 % of what a conservative cloud of any thickness under any Sun reflects.
    np.testing.assert_allclose(reflected[..., 0], 1.0, atol=1e-3)
    # t = 20 under the Sun at 60 deg; King 1987 (J. Atmos. Sci. 44, 1734) has 0.1 and 0.3 less for
    # drops of 10 um.
    place = round(np.log(20.0) / np.log(100.0) * (CLOUD_PLACES - 1))
    sun = round(np.sqrt(0.5) * (CLOUD_PLACES - 1))
    assert reflected[sun, place, 1] == pytest.approx(0.88, abs=0.05)
    assert reflected[sun, place, 2] == pytest.approx(0.68, abs=0.08)
    assert np.all(lost[..., 2] >= lost[..., 0] - 1e-6)
    assert np.all(
        ice_cloud(_bands((600, 700), (1630, 1660)))[:2] == pytest.approx([1, 0.9], abs=0.06)
    )


def test_two_streams_lose_nothing_without_absorption_and_keep_the_shader_s_formula() -> None:
    tau, mu = np.array([1.0, 5.0, 20.0, 50.0]), np.array([0.5])
    reflected, through = two_streams(np.zeros(1), 0.85, tau, mu)
    np.testing.assert_allclose(reflected + through, 1.0, atol=2e-5)
    scaled_tau, g = (1.0 - 0.85**2) * tau, 0.85 / 1.85
    g1, g3 = 0.75 * (1.0 - g), 0.5 - 0.75 * g * mu
    shader = g1 * scaled_tau + (g3 - g1 * mu) * (1.0 - np.exp(-scaled_tau / mu))
    np.testing.assert_allclose(reflected, shader / (1.0 + g1 * scaled_tau), atol=2e-5)


def test_water_mirrors_less_in_the_infrared() -> None:
    green, short = water_mirror(_bands((540, 560), (1640, 1660)))[:2]
    # F0 of 1.333 and 1.316 over that of 1.34.
    assert green == pytest.approx((0.333 / 2.333) ** 2 / (0.34 / 2.34) ** 2, rel=3e-3)
    assert short == pytest.approx((0.316 / 2.316) ** 2 / (0.34 / 2.34) ** 2, rel=5e-3)
