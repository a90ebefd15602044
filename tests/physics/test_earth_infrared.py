"""The infrared Earth: its mean outgoing flux, its climate, and the limits of its law."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.physics.constants import STEFAN_BOLTZMANN, WGS84_EQUATORIAL_RADIUS
from simgl.physics.earth_infrared import (
    clear_transmission,
    longwave_radiance,
    shader_values,
    temperature_of_flux,
)


def zonal(x: np.ndarray, day: float) -> np.ndarray:
    """(...) mean of a day by the sine of latitude [K], as the shader makes it."""
    of = shader_values(day, WGS84_EQUATORIAL_RADIUS)
    legendre = 0.5 * (3.0 * x * x - 1.0)
    return of["mean_temperature"] + of["second_harmonic"] * legendre + of["season"] * x


@pytest.mark.parametrize("day", [15.0, 105.0, 196.0])
def test_240_watts_leave_each_square_metre_in_the_mean(day: float) -> None:
    # The sine of latitude is uniform over a sphere.
    x, weight = np.polynomial.legendre.leggauss(16)
    flux = np.pi * longwave_radiance(zonal(x, day), separate_clouds=False)
    assert 0.5 * weight @ flux == pytest.approx(240.0, abs=1e-9)


def test_north_is_warm_in_july_and_land_swings_more_than_the_sea() -> None:
    north = np.array([0.7])
    assert zonal(north, 205.0) > zonal(north, 20.0) + 10.0
    assert zonal(-north, 205.0) < zonal(-north, 20.0) - 10.0
    of = shader_values(80.0, WGS84_EQUATORIAL_RADIUS)
    mean = of["mean_land"] * of["land_swing"] + (1.0 - of["mean_land"]) * of["sea_swing"]
    assert mean == pytest.approx(4.0, rel=1e-9)
    assert of["land_swing"] > 10.0 > of["sea_swing"]


def test_cloud_tops_send_no_more_than_black_bodies() -> None:
    # From the tropopause to warm ground; the linear law crosses a black body's at its cold end.
    kelvin = np.linspace(200.0, 305.0, 100)
    black = STEFAN_BOLTZMANN * kelvin**4
    flux = np.pi * longwave_radiance(kelvin, separate_clouds=True)
    assert np.all(flux < 1.03 * black)
    assert np.all(np.diff(flux) > 0.0)
    high, ground = np.pi * longwave_radiance(np.array([223.0, 300.0]), separate_clouds=True)
    assert high == pytest.approx(STEFAN_BOLTZMANN * 223.0**4, rel=0.1)
    assert high < 0.5 * ground


def test_ground_of_one_flux_is_a_black_body() -> None:
    kelvin = temperature_of_flux(239.0)
    assert STEFAN_BOLTZMANN * kelvin**4 == pytest.approx(239.0, rel=1e-12)
    of = shader_values(80.0, WGS84_EQUATORIAL_RADIUS, kelvin)
    assert of["mean_temperature"] == kelvin
    assert of["second_harmonic"] == of["season"] == of["land_swing"] == of["sea_swing"] == 0.0


def test_windows_of_the_air() -> None:
    assert clear_transmission((8e-6, 14e-6)) > clear_transmission((3e-6, 5e-6))
    assert clear_transmission((5.5e-6, 7.5e-6)) == 0.1
