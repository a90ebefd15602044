"""The airglow is what the dark sky over an observatory needs it to be."""

from __future__ import annotations

import numpy as np

from simgl.physics.airglow import zenith_glow
from simgl.physics.constants import LIGHT_SPEED, PLANCK, SOLAR_TEMPERATURE
from simgl.physics.spectrum import planck_radiance


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
