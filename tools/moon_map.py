"""The shipped map of the Moon: its seas drawn from the places and sizes of named features.

    python -m tools.moon_map

Centres and diameters are rounded from the IAU's Gazetteer of Planetary Nomenclature; large seas are
several ellipses. Seas reflect about half as much as highlands (Allen, 4th ed., section 12). Their
outlines and the mottling are noise: the map serves a Moon of some hundred pixels, not navigation.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image
from scipy.ndimage import gaussian_filter

from simgl.arrays import Array
from simgl.physics.constants import MOON_RADIUS

WIDTH, HEIGHT = 512, 256
# The file's codes over this are reflectance over that of the whole disc.
SCALE = 128.0


# Longitude east, latitude [deg], half widths east and north [km], depth of the darkening 0..1.
_SEAS = (
    (-15.6, 32.8, 570, 540, 0.9),  # Imbrium
    (17.5, 28.0, 360, 340, 1.0),  # Serenitatis
    (31.4, 8.5, 420, 330, 1.0),  # Tranquillitatis
    (24.0, 2.0, 250, 170, 0.9),
    (59.1, 17.0, 280, 215, 1.0),  # Crisium
    (51.3, -7.8, 310, 430, 0.9),  # Fecunditatis
    (35.5, -15.2, 175, 170, 0.9),  # Nectaris
    (3.6, 13.3, 130, 120, 0.8),  # Vaporum
    (1.7, 2.4, 150, 110, 0.7),  # Sinus Medii
    (-8.8, 10.9, 150, 140, 0.8),  # Sinus Aestuum
    (-30.9, 7.5, 300, 230, 0.8),  # Insularum
    (-23.1, -10.0, 200, 190, 0.9),  # Cognitum
    (-16.6, -21.3, 340, 330, 0.9),  # Nubium
    (-38.6, -24.4, 205, 215, 1.0),  # Humorum
    (-57.4, 18.4, 380, 560, 1.0),  # Procellarum
    (-50.0, 4.0, 420, 330, 1.0),
    (-45.0, 30.0, 330, 330, 1.0),
    (-58.0, 42.0, 250, 330, 0.9),
    (-46.0, -8.0, 260, 260, 0.9),
    (0.0, 56.0, 800, 110, 0.7),  # Frigoris
    (-31.5, 44.1, 120, 120, 0.9),  # Sinus Iridum
    (29.2, 38.0, 220, 120, 0.5),  # Lacus Somniorum
    (81.5, 56.8, 115, 115, 0.8),  # Humboldtianum
    (86.1, 13.3, 180, 190, 0.6),  # Marginis
    (87.1, 1.3, 190, 190, 0.8),  # Smythii
    (68.4, 7.5, 120, 120, 0.6),  # Undarum
    (93.0, -38.9, 300, 300, 0.5),  # Australe
    (-92.8, -19.4, 150, 150, 0.8),  # Orientale
    (-68.3, -5.5, 90, 90, 1.0),  # Grimaldi
    (-9.4, 51.6, 50, 50, 1.0),  # Plato
    (147.9, 27.3, 140, 140, 0.8),  # Moscoviense
    (163.5, -33.7, 140, 140, 0.7),  # Ingenii
)
# Longitude, latitude [deg], radius of the bright halo [km], its brightening.
_RAYED = (
    (-11.4, -43.3, 330, 0.45),  # Tycho
    (-20.1, 9.6, 200, 0.40),  # Copernicus
    (-38.0, 8.1, 130, 0.40),  # Kepler
    (-47.4, 23.7, 110, 0.60),  # Aristarchus
    (46.8, 16.1, 110, 0.45),  # Proclus
    (61.0, -8.9, 150, 0.25),  # Langrenus
    (54.2, -32.5, 180, 0.35),  # Stevinus
)
_HIGHLAND, _SEA = 1.0, 0.5


def _noise(rng: np.random.Generator, width: float) -> Array:
    """Of unit variance, its lumps so many texels wide."""
    values = gaussian_filter(rng.normal(size=(HEIGHT, WIDTH)), width, mode=("nearest", "wrap"))
    return values / values.std()


def reflectance() -> Array:
    """(HEIGHT, WIDTH) over the mean of the disc seen from longitude and latitude 0.

    Row 0 is north, column 0 longitude -180 deg.
    """
    rng = np.random.default_rng(1969)
    ragged = 0.12 * _noise(rng, 5.0) + 0.04 * _noise(rng, 2.0)
    mottled = 1.0 + 0.04 * _noise(rng, 8.0) + 0.025 * _noise(rng, 1.5)
    longitude = ((np.arange(WIDTH) + 0.5) / WIDTH - 0.5) * 360.0
    latitude = (0.5 - (np.arange(HEIGHT) + 0.5) / HEIGHT)[:, None] * 180.0
    dark = np.zeros((HEIGHT, WIDTH))
    kilometre = 180.0 / np.pi / (MOON_RADIUS * 1e-3)  # [deg]
    for east, north, half_east, half_north, depth in _SEAS:
        x = (longitude - east) * np.cos(np.radians(latitude)) / (half_east * kilometre)
        y = (latitude - north) / (half_north * kilometre)
        edge = (1.0 + ragged - np.hypot(x, y)) * min(half_east, half_north) * kilometre
        dark = np.maximum(dark, depth * np.clip(0.5 + edge / 4.0, 0.0, 1.0))
    bright = np.zeros((HEIGHT, WIDTH))
    for east, north, radius, strength in _RAYED:
        x = (longitude - east) * np.cos(np.radians(latitude)) / (radius * kilometre)
        y = (latitude - north) / (radius * kilometre)
        rays = 0.6 + 0.4 * np.cos(7.0 * np.arctan2(y, x) + east) ** 4
        bright += strength * rays * np.exp(-2.0 * np.hypot(x, y))
    ground = (_HIGHLAND + (_SEA - _HIGHLAND) * dark) * mottled + bright * (1.0 - 0.5 * dark)
    seen = np.cos(np.radians(latitude)) * np.cos(np.radians(longitude))
    # A texel's share of the disc: its area times the cosine to the line of sight.
    weight = np.maximum(seen, 0.0) * np.cos(np.radians(latitude))
    return ground * weight.sum() / (ground * weight).sum()


def make(path: Path) -> None:
    """Write the map."""
    code = np.clip(np.round(SCALE * reflectance()), 0, 255).astype(np.uint8)
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(code).save(path, optimize=True)


if __name__ == "__main__":
    make(Path(__file__).resolve().parents[1] / "simgl" / "data" / "sky" / "moon.png")
