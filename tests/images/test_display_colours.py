"""Colours that people see: previews against the CIE 1931 observer.

Its colour-matching functions by the fits of Wyman, Sloan and Shirley (2013, J. Comput. Graph.
Tech. 2).
"""

from __future__ import annotations

import numpy as np
import pytest

from simgl.arrays import Array
from simgl.display_colours import SRGB_FROM_RGBN, WHITE_RADIANCE
from simgl.display_images import display_from_radiance
from simgl.physics.spectrum import planck_radiance

WAVELENGTH: Array = np.arange(400.5, 700.0)  # [nm]
SUNLIGHT = planck_radiance(WAVELENGTH * 1e-9, 5777.0)
SRGB_FROM_XYZ = np.array(
    [
        [3.2404542, -1.5371385, -0.4985314],
        [-0.9692660, 1.8760108, 0.0415560],
        [0.0556434, -0.2040259, 1.0572252],
    ]
)


def lobe(middle: float, below: float, above: float) -> Array:
    width = np.where(middle > WAVELENGTH, below, above)
    return np.asarray(np.exp(-0.5 * ((WAVELENGTH - middle) / width) ** 2))


OBSERVER = np.stack(
    [
        1.056 * lobe(599.8, 37.9, 31.0)
        + 0.362 * lobe(442.0, 16.0, 26.7)
        - 0.065 * lobe(501.1, 20.4, 26.2),
        0.821 * lobe(568.8, 46.9, 40.5) + 0.286 * lobe(530.9, 16.3, 31.1),
        1.217 * lobe(437.0, 11.8, 36.0) + 0.681 * lobe(459.0, 26.0, 13.8),
    ]
)


def seen(spectrum: Array) -> Array:
    """(3,) linear sRGB of a spectrum, adapted to sunlight."""
    return SRGB_FROM_XYZ @ OBSERVER @ spectrum / (SRGB_FROM_XYZ @ OBSERVER @ SUNLIGHT)


def shown(spectrum: Array) -> Array:
    """(3,) linear sRGB of it in a preview."""
    bands = [spectrum[part].sum() / SUNLIGHT[part].sum() for part in PARTS]
    return np.asarray(SRGB_FROM_RGBN @ bands)


PARTS = slice(200, 300), slice(100, 200), slice(0, 100)


def lab(linear: Array) -> Array:
    """(3,) CIELAB of linear sRGB."""
    to_xyz = np.linalg.inv(SRGB_FROM_XYZ)
    f = np.cbrt(np.maximum(to_xyz @ linear, 0.0) / to_xyz.sum(axis=1))
    return np.array([116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])])


def test_a_white_cloud_in_sunlight_is_neutral() -> None:
    grey = np.append(0.5 * WHITE_RADIANCE, 0.0).astype(np.float32)
    code = display_from_radiance(grey[None, None])[0, 0]
    assert np.ptp(code) <= 1
    assert shown(SUNLIGHT) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("exponent", [4.0, 2.5])
def test_a_sky_of_molecules_and_haze_has_its_hue(exponent: float) -> None:
    """Bands as primaries miss it by 2.4 deg, towards violet."""
    sky = SUNLIGHT * (500.0 / WAVELENGTH) ** exponent
    scale = 0.6 / seen(sky).max()
    hue = [np.degrees(np.arctan2(*lab(scale * of(sky))[:0:-1])) for of in (shown, seen)]
    assert hue[0] == pytest.approx(hue[1], abs=1.0)


@pytest.mark.parametrize("temperature", [3200.0, 4200.0, 8000.0])
def test_warm_and_cold_light_differ_from_what_people_see_by_less_than_2(temperature: float) -> None:
    """In CIELAB, where 2.3 is just noticeable."""
    light = planck_radiance(WAVELENGTH * 1e-9, temperature)
    scale = 0.6 / seen(light).max()
    assert np.linalg.norm(lab(scale * shown(light)) - lab(scale * seen(light))) < 2.0
