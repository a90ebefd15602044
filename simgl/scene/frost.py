"""Sea ice and snow by the time of the year: where they end, and what they reflect.

The climatology is made by ``tools/ice_edges.py``. Edges are latitudes by month and longitude.
"""

from __future__ import annotations

from functools import cache, lru_cache

import numpy as np

from simgl import assets
from simgl.arrays import Array
from simgl.physics.earth_spectra import MELTING_GRAIN, SNOW_GRAIN, snow_reflectance
from simgl.physics.spectral_form import scaled
from simgl.physics.spectrum import BANDS, Bands

# Of the table: strips of longitude, 10 deg wide from 180 deg west on.
_STRIPS = 36
# Of the edges that are made of it.
_COLUMNS = 720
_EPOCH_DAYS = 10957  # of 2000-01-01 since 1970-01-01
_DAYS_OF_YEAR = 365.2425
# Steps of a year: the sky about a spacecraft is kept as long as the season is the same.
_STEPS = 1024
# How far [deg] before its edge there may be ice or snow: half the edge's width, and for snow what
# mountains and hills add (shaders/planet/frost.glsl).
_REACH = np.array([4.0, 4.0, 10.0])

# Reflectance of sea ice, R, G, B, N: under dry snow, and with ponds of meltwater (Perovich et al.
# 2002, J. Geophys. Res. 107, 8044: 0.8 to 0.85 in April, 0.4 to 0.6 in July in the visible).
_COLD_ICE = np.array([0.80, 0.81, 0.82, 0.70])
_MELTING_ICE = np.array([0.52, 0.56, 0.60, 0.36])
# Melting of ice from mid-January to mid-December, in the north and the south, where few ponds form.
_MELTING = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.2, 0.7, 1.0, 0.9, 0.4, 0.0, 0.0, 0.0],
        [0.2, 0.2, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.1],
    ]
)


def year_share(tai_ns: int) -> float:
    """Share of the year that is over, 0 to 1, in steps of 9 hours, within two days.

    tai_ns : TAI nanoseconds since 1970
    """
    days = tai_ns / 86_400e9 - _EPOCH_DAYS
    return round(days / _DAYS_OF_YEAR % 1.0 * _STEPS) % _STEPS / _STEPS


@cache
def frost_edges() -> Array:
    """(12, 720, 3) latitude [deg] to which sea ice comes from the north, from the south, and snow
    on land from the north; by month, and by longitude from 180 deg west on.

    The table's strips are joined smoothly, and the line winds as edges of ice do.
    """
    table = np.loadtxt(assets.data() / "earth" / "frost_edges.csv", delimiter=",", skiprows=1)
    table = table[:, 2:].reshape(12, _STRIPS, 3)
    steps = np.repeat(table, _COLUMNS // _STRIPS, axis=1)
    # A bell as wide as two strips keeps the mean of each month, without overshoots at coasts.
    bell = np.zeros(_COLUMNS)
    width = 2 * _COLUMNS // _STRIPS
    bell[np.arange(-width // 2 + 1, width // 2)] = np.hanning(width + 1)[1:-1]
    spectrum = np.fft.rfft(bell / bell.sum())[:, None]
    edges = np.fft.irfft(np.fft.rfft(steps, axis=1) * spectrum, _COLUMNS, axis=1)
    return np.asarray(edges + _winding()[:, None])


def _winding() -> Array:
    """(720,) by how much an edge winds, 0.7 deg rms [deg]: waves of 40 to 4 deg of longitude."""
    rng = np.random.default_rng(3)
    waves = np.arange(9, 90)
    turns = rng.uniform(0.0, 2.0 * np.pi, waves.size)
    angle = np.arange(_COLUMNS)[:, None] * 2.0 * np.pi / _COLUMNS * waves + turns
    wound = np.sum(np.sin(angle) / waves**1.5, axis=1)
    return np.asarray(0.7 * wound / np.sqrt(np.mean(wound**2)))


def _between_months(year: float) -> tuple[int, int, float]:
    """The months in whose middles a time of the year lies, and how far from the first it is."""
    first = np.floor(12.0 * year - 0.5)
    return int(first) % 12, int(first + 1) % 12, float(12.0 * year - 0.5 - first)


@lru_cache(maxsize=8)
def frost_limits(year: float) -> tuple[float, float]:
    """Latitudes [rad] between which there is neither ice nor snow: in the south, in the north."""
    first, second, along = _between_months(year)
    edges = frost_edges()
    now = (1.0 - along) * edges[first] + along * edges[second]
    north = float((now - _REACH)[:, [0, 2]].min())
    south = float((now + _REACH)[:, 1].max())
    return float(np.radians(south)), float(np.radians(north))


# Reflectance of dry snow on open ground, and of an ice sheet where it never melts, R, G, B, N
# (shaders/planet/frost.glsl).
_SNOW, _DRY_SNOW = (0.80, 0.81, 0.82, 0.70), (0.96, 0.97, 0.97, 0.88)


def snow_in_bands(bands: Bands) -> Array:
    """(2, 4) of snow on open ground and of an ice sheet, per band."""
    return np.array([scaled(one, _dry, bands) for one in (_SNOW, _DRY_SNOW)])


def _dry(nm: Array) -> Array:
    return snow_reflectance(nm, SNOW_GRAIN)


def _wet(nm: Array) -> Array:
    return snow_reflectance(nm, MELTING_GRAIN)


@lru_cache(maxsize=8)
def ice_reflectance(year: float, bands: Bands = BANDS) -> Array:
    """(2, 4) of sea ice in the north and in the south, per band."""
    first, second, along = _between_months(year)
    melting = (1.0 - along) * _MELTING[:, first] + along * _MELTING[:, second]
    cold, wet = scaled(_COLD_ICE.tolist(), _dry, bands), scaled(_MELTING_ICE.tolist(), _wet, bands)
    reflectance = np.asarray(cold + melting[:, None] * (wet - cold))
    reflectance.flags.writeable = False
    return reflectance
