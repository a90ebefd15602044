"""The Moon's law of reflection sums to the light of its disc; it shows us one face."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.arrays import Array
from simgl.physics.ephemeris import moon_position, tai_ns_from_utc
from simgl.physics.lunar_model import (
    disc_reflectance,
    lommel_seeliger_share,
    moon_from_icrf,
    surface_factor,
)
from simgl.physics.spectrum import Bands


def by_summing_the_disc(phase: float) -> Array:
    """(4,) reflectance of the disc: the law's mean over its circle."""
    n = 1500
    x, y = np.meshgrid(*2 * [(np.arange(n) + 0.5) / n * 2.0 - 1.0])
    mu = np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))
    mu0 = np.maximum(x * np.sin(phase) + mu * np.cos(phase), 0.0) * (mu > 0.0)
    s = lommel_seeliger_share(phase)
    law = s * mu0 / np.maximum(mu0 + mu, 1e-12) + (1.0 - s) * 0.5 * mu0
    return np.asarray(surface_factor(phase) * np.sum(law) * (2.0 / n) ** 2)


@pytest.mark.parametrize("degrees", [0.0, 10.0, 45.0, 90.0, 120.0, 148.0])
def test_the_law_sums_to_the_measured_reflectance(degrees: float) -> None:
    phase = np.radians(degrees)
    # Squares along the limb and the terminator: some 1 / n of the crescent's width.
    np.testing.assert_allclose(by_summing_the_disc(phase), disc_reflectance(phase), rtol=4e-3)


def test_the_full_moon_is_as_bright_as_measured() -> None:
    """V = -12.74 at mean distance (Allen, section 12) at some 2.5 deg, clear of eclipses."""
    disc = disc_reflectance(np.radians(2.5))[1]
    v = -26.76 - 2.5 * np.log10(disc * (1737.4 / 384_400.0) ** 2)
    # A tenth of a magnitude for either.
    np.testing.assert_allclose(v, -12.74, atol=0.15)


def test_the_opposition_surge_is_there() -> None:
    """From 10 to 2 deg the Moon brightens by 0.4 mag, where a straight line gives 0.2."""
    rise = disc_reflectance(np.radians(2.0)) / disc_reflectance(np.radians(10.0))
    assert np.all((rise > 1.38) & (rise < 1.52))


# Of the Lunar Irradiance Model of ESA, release of 2025-10-10, without longitude and libration:
# wavelength [nm], reflectance of the disc at phase angles of 10, 45 and 90 deg.
LIME = np.array(
    [
        (440.0, 0.073855, 0.029700, 0.008276),
        (675.0, 0.110382, 0.047853, 0.013879),
        (870.0, 0.128609, 0.057689, 0.017107),
    ]
)


@pytest.mark.parametrize("row", range(len(LIME)))
def test_its_light_at_a_wavelength_is_that_of_the_lunar_irradiance_model(row: int) -> None:
    nm, *expected = LIME[row]
    bands = Bands(names=("x",), edges=((1e-9 * (nm - 1.0), 1e-9 * (nm + 1.0)),))
    seen = [disc_reflectance(np.radians(degrees), bands)[0] for degrees in (10.0, 45.0, 90.0)]
    # Its spectrum bends there, over a band of 2 nm.
    np.testing.assert_allclose(seen, expected, rtol=2e-3)


# Of Kieffer & Stone (2005), table 4: wavelength [nm], a0 to a3, d1 to d3; libration left out.
OLDER_MODEL = np.array(
    [
        (665.1, -1.88914, -1.58096, 0.30477, -0.17908, 0.37141, -0.13514, 0.01248),
        (549.1, -2.10782, -1.66736, 0.41697, -0.22026, 0.36814, -0.09815, -0.00000),
        (441.6, -2.31964, -1.72114, 0.37286, -0.19304, 0.37935, -0.09562, 0.00970),
        (865.3, -1.74561, -1.58482, 0.35009, -0.19569, 0.39200, -0.18837, 0.00978),
    ]
)


@pytest.mark.parametrize("degrees", [10.0, 20.0, 45.0, 90.0])
def test_an_older_model_lies_a_few_per_cent_below_it(degrees: float) -> None:
    phase = np.radians(degrees)
    a, d = OLDER_MODEL[:, 1:5], OLDER_MODEL[:, 5:]
    near = [
        np.exp(-degrees / 4.06054),
        np.exp(-degrees / 12.8802),
        np.cos((degrees + 30.5858) / 16.7498),
    ]
    older = np.exp(a @ phase ** np.arange(4) + d @ near)
    # 3 to 5 % (Toledano et al. 2024). Its wavelengths scatter by 6 % about a smooth line, the mean
    # of four by half of that.
    ratio = float(np.mean(disc_reflectance(phase) / older))
    assert 0.99 < ratio < 1.08


@pytest.mark.parametrize("degrees", [90.0, 104.1, 150.0])
def test_nothing_jumps_where_laws_join(degrees: float) -> None:
    near = [surface_factor(np.radians(degrees + d)) for d in (-1e-3, 1e-3)]
    np.testing.assert_allclose(near[0], near[1], rtol=1e-3)


def test_the_moon_shows_the_earth_one_face_but_for_its_libration() -> None:
    start = tai_ns_from_utc("2020-01-01T00:00:00")
    days = start + np.arange(0, 6798, 3) * 86_400_000_000_000  # one turn of the orbit's node
    seen = []
    for tai_ns in days.tolist():
        towards_earth = -moon_position(tai_ns)
        x, y, z = moon_from_icrf(tai_ns) @ (towards_earth / np.linalg.norm(towards_earth))
        seen.append(np.degrees([np.arctan2(y, x), np.arcsin(z)]))
    east, north = np.array(seen).T
    # Optical libration from the Earth's centre: 7.9 deg in longitude, 6.9 in latitude, mean 0.
    assert 7.0 < np.abs(east).max() < 8.3
    assert 6.5 < np.abs(north).max() < 7.0
    np.testing.assert_allclose([east.mean(), north.mean()], 0.0, atol=0.2)


def test_the_moons_axis_leans_by_cassinis_angle() -> None:
    R = moon_from_icrf(tai_ns_from_utc("2026-03-20T12:00:00"))
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(np.linalg.det(R), 1.0, atol=1e-14)
    obliquity = np.radians(23.4393)
    ecliptic_pole = np.array([0.0, -np.sin(obliquity), np.cos(obliquity)])
    np.testing.assert_allclose(np.degrees(np.arccos(R[2] @ ecliptic_pole)), 1.543, atol=0.03)
