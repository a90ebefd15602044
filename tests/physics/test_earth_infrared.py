"""The infrared Earth: its mean outgoing flux, and the limits of its air."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from simgl.physics.earth_infrared import (
    InfraredAir,
    clear_transmission,
    earth_radiance,
    ground_temperature,
    outgoing_longwave,
    zonal_temperature,
)
from simgl.physics.thermal_radiation import band_radiance, band_temperature

WINDOW = (8e-6, 14e-6)


@pytest.mark.parametrize("day", [15.0, 105.0, 196.0])
def test_240_watts_leave_each_square_metre_in_the_mean(day: float) -> None:
    # The sine of latitude is uniform over a sphere.
    x, weight = np.polynomial.legendre.leggauss(16)
    assert 0.5 * weight @ outgoing_longwave(x, day) == pytest.approx(240.0, abs=1e-9)


def test_north_is_warm_in_july_and_afternoons_are_warm() -> None:
    assert zonal_temperature(0.7, 205.0) > zonal_temperature(0.7, 20.0) + 10.0
    assert zonal_temperature(-0.7, 205.0) < zonal_temperature(-0.7, 20.0) - 10.0
    assert ground_temperature(0.0, 80.0, 14.0) > ground_temperature(0.0, 80.0, 2.0) + 7.0


def test_without_air_and_cloud_the_ground_is_black() -> None:
    emission = partial(band_radiance, WINDOW)
    bare = InfraredAir(transmission=1.0, cloud_cover=0.0, cloud_height=0.0)
    t = np.array([220.0, 260.0, 300.0])
    light = earth_radiance(t, np.ones(3), bare, emission)
    # Interpolation of Planck's law over half a kelvin.
    np.testing.assert_allclose(band_temperature(WINDOW, light), t, atol=0.005)


def test_air_and_cloud_are_colder_than_the_ground_most_so_at_the_limb() -> None:
    emission = partial(band_radiance, WINDOW)
    air = InfraredAir(transmission=clear_transmission(WINDOW), cloud_cover=0.0, cloud_height=4000.0)
    t = np.full(3, 288.0)
    seen = band_temperature(WINDOW, earth_radiance(t, np.array([1.0, 0.5, 0.1]), air, emission))
    assert np.all(np.diff(seen) < 0.0)
    assert 288.0 - 20.0 <= seen[2] < seen[0] < 288.0
    overcast = InfraredAir(transmission=0.6, cloud_cover=1.0, cloud_height=10_000.0)
    light = earth_radiance(t, np.ones(3), overcast, emission)
    np.testing.assert_allclose(band_temperature(WINDOW, light), 288.0 - 65.0, atol=0.01)
