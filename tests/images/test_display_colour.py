"""Pictures for people against colorimetry: the bands stand for sRGB's primaries.

What an eye adapted to sunlight sees of a spectrum follows from CIE's colour matching functions;
what the display step shows, from the three bands alone. They agree for what sunlight makes of
air, cloud and sea, so that the blue of sky and limb is in the light. They do not where ozone has
cut into the middle of the spectrum: it takes most where green ends and red begins, and no mean of
bands tells.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

Array = np.ndarray[Any, Any]

NM = np.arange(380.0, 781.0)
BANDS = ((600.0, 700.0), (500.0, 600.0), (400.0, 500.0))
SRGB_FROM_XYZ = np.array(
    [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]]
)


def lobe(middle: float, below: float, above: float) -> Array:
    return np.exp(-0.5 * ((NM - middle) * np.where(middle > NM, below, above)) ** 2)


def colour_matching() -> Array:
    """(3, n) CIE 1931 by Wyman, Sloan and Shirley (2013), good to 1 % of the peaks."""
    x = 1.056 * lobe(599.8, 0.0264, 0.0323) + 0.362 * lobe(442.0, 0.0624, 0.0374)
    x -= 0.065 * lobe(501.1, 0.0490, 0.0382)
    y = 0.821 * lobe(568.8, 0.0213, 0.0247) + 0.286 * lobe(530.9, 0.0613, 0.0322)
    z = 1.217 * lobe(437.0, 0.0845, 0.0278) + 0.681 * lobe(459.0, 0.0385, 0.0725)
    return np.stack([x, y, z])


SUNLIGHT = 1.0 / (NM**5 * (np.exp(1.4388e7 / (NM * 5777.0)) - 1.0))


def seen(share: Array) -> Array:
    """Linear sRGB of sunlight times a spectrum, white for sunlight itself."""
    matrix = SRGB_FROM_XYZ @ colour_matching()
    return matrix @ (SUNLIGHT * share) / (matrix @ SUNLIGHT)


def shown(share: Array) -> Array:
    """The same of its bands, as the display step has it."""
    within = [(low <= NM) & (high > NM) for low, high in BANDS]
    return np.array([np.average(share[band], weights=SUNLIGHT[band]) for band in within])


RAYLEIGH = 0.0973 * (NM / 550.0) ** -4.0
WATER = np.interp(
    NM, [380.0, 460.0, 500.0, 550.0, 600.0, 700.0], [0.05, 0.035, 0.02, 0.006, 0.001, 0]
)


@pytest.mark.parametrize(
    ("name", "share"),
    [
        ("clear sky", RAYLEIGH),
        ("limb", 1.0 - np.exp(-30.0 * RAYLEIGH)),
        ("far cloud", 0.4 + 0.2 * np.exp(-6.0 * RAYLEIGH)),
        ("sea through air", WATER + 0.2 * RAYLEIGH),
    ],
)
def test_bands_as_primaries_show_what_an_eye_sees_of_air_and_sea(name: str, share: Array) -> None:
    wanted, actual = seen(share), shown(share)
    # Steps of 0.05 of the brightest primary: a tenth of the way from sky blue to violet.
    np.testing.assert_allclose(
        actual / actual.max(), wanted / wanted.max(), atol=0.05, err_msg=name
    )
