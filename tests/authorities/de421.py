"""Geocentric places of the Sun and the Moon from the JPL ephemeris DE421.

Source: DE421 (Folkner, Williams & Boggs 2008), read with jplephem 2.24 at the TDB of each instant;
geometric (no light time, no aberration), ICRF axes, from the Earth's centre [km].
"""

from __future__ import annotations

from dataclasses import dataclass

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Places:
    """sun, moon : (3,) geocentric [km] at an instant of UTC."""

    utc: str
    sun: Triple
    moon: Triple


DE421 = (
    Places(
        "2026-03-20T12:00:00",
        (148977225.3308602, -1137256.675600408, -493594.48810297204),
        (349335.5887780017, 98596.11221662367, 66373.23201870556),
    ),
    Places(
        "2024-06-21T00:00:00",
        (557277.1399392416, 139479890.22876656, 60462220.65177211),
        (-87893.67058497011, -330113.59798503714, -176257.41536978618),
    ),
    Places(
        "2010-01-03T06:30:00",
        (32154068.0073601, -131697294.28025894, -57094500.89402725),
        (-264536.1770074276, 230133.40914693137, 83636.23998260665),
    ),
    Places(
        "2035-09-01T18:45:12.5",
        (-140657919.2988927, 50361686.102384984, 21830611.566265125),
        (-334414.4494286405, 145131.62596091544, 62721.95980838766),
    ),
)
