"""The airglow is what the dark sky over an observatory needs it to be."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from simgl.physics.airglow import RAYLEIGH, zenith_glow
from simgl.physics.constants import LIGHT_SPEED, PLANCK, SOLAR_TEMPERATURE
from simgl.physics.spectrum import Bands, Curve, planck_radiance


def test_with_zodiacal_light_it_is_the_dark_sky_measured_over_paranal() -> None:
    """B 22.6, V 21.6, R 20.9 mag per square arcsecond (Patat 2003, A&A 400, 1183)."""
    # Bands G, B, R of 100 nm stand for V, B, R.
    middle = np.array([650e-9, 550e-9, 450e-9])
    # Spectral irradiance of magnitude 0 (Bessell, Castelli & Plez 1998, table A2) [W m-2 m-1].
    zero = np.array([2.177e-2, 3.631e-2, 6.32e-2])
    per_square_arcsecond = (np.pi / 648e3) ** 2
    measured = zero * 10.0 ** (-0.4 * np.array([20.9, 21.6, 22.6])) / per_square_arcsecond
    # Measured in 2000 and 2001, at the Sun's maximum: 1.35 times the glow of its mean activity.
    glow = 1.35 * zenith_glow(from_below=True)[:3] / 100e-9
    # The lines of oxygen at 630 and 636 nm, 276 R then, belong to another layer.
    photons = 276.0 * 1e10 / (4.0 * np.pi)
    glow[0] += photons * PLANCK * LIGHT_SPEED / 630e-9 / 100e-9
    # 60 S10, the least there is: as many stars of V = 10 per square degree, of the Sun's colour.
    s10 = zero[1] * 10.0 ** (-0.4 * 10.0) / np.radians(1.0) ** 2
    colour = planck_radiance(middle, SOLAR_TEMPERATURE) / planck_radiance(
        middle[1:2], SOLAR_TEMPERATURE
    )
    sky = glow + 60.0 * s10 * colour
    # The model of the glow claims 20 %.
    np.testing.assert_allclose(-2.5 * np.log10(sky / measured), 0.0, atol=0.2)


def glow_in(low: float, high: float, curve: Curve | None = None) -> float:
    """From above, in a band of a scenario between wavelengths [nm], behind a filter."""
    bands = Bands(names=("one",), edges=((1e-9 * low, 1e-9 * high),), filter=curve)
    return float(zenith_glow(from_below=False, bands=bands)[0])


@pytest.mark.parametrize(
    ("low", "high", "channel"), [(600, 700, 0), (500, 600, 1), (400, 500, 2), (700, 1000, 3)]
)
def test_narrow_bands_side_by_side_have_the_glow_of_the_wide_one(
    low: float, high: float, channel: int
) -> None:
    parts = [glow_in(a, b) for a, b in pairwise(np.linspace(low, high, 8).tolist())]
    # None is dark: hydroxyl's bands and continua fill each seventh of a band.
    assert min(parts) > 0.0
    # The steps of a band are rounded to 1e-15 m, a seventh of 100 nm to 1e-7 of itself.
    np.testing.assert_allclose(sum(parts), zenith_glow(from_below=False)[channel], rtol=1e-6)


def test_hydroxyl_from_700_to_900_nm_is_brighter_than_its_six_bands_alone() -> None:
    # 7.0 kR in the model, 4.4 kR measured in six bands; oxygen's line at 762 nm left out. What is
    # even over wavelength in power has 838 nm / 800 nm less photons at its middle.
    power = glow_in(700.0, 757.0) + glow_in(770.0, 900.0)
    photons = power * 800e-9 / (PLANCK * LIGHT_SPEED)
    assert photons / RAYLEIGH == pytest.approx(7000.0 * 187.0 / 200.0 * 800.0 / 838.3, rel=1e-6)
    assert photons / RAYLEIGH > 4400.0


def test_a_filter_passes_its_mean_transmission() -> None:
    # A triangle, 0 at its ends: the wide groups' mean wavelengths lie beyond them. In steps of 1 nm
    # its mean is 0.5.
    triangle = ((720.0, 735.0, 750.0), (0.0, 1.0, 0.0))
    half = 0.5 * glow_in(720.0, 750.0)
    assert glow_in(720.0, 750.0, triangle) == pytest.approx(half, rel=5e-3)
