"""Visible fraction of the Sun behind a spherical Earth, seen from 400 km.

Sphere of 6371 km, no refraction, uniform disc of half-angle 0.263 deg. Source: direct quadrature of
the disc in float64, made independently of this code; stated accuracy 1e-5.
"""

from __future__ import annotations

EARTH_RADIUS = 6.371e6  # [m]
ALTITUDE = 4.0e5  # [m]
SUN_HALF_ANGLE_DEG = 0.263

# (solar zenith angle - 90 deg, visible fraction)
FRACTIONS = (
    (19.5296, 1.0),
    (19.6000, 0.92034),
    (19.7000, 0.71956),
    (19.7926, 0.50017),
    (19.8452, 0.37369),
    (19.9000, 0.24757),
    (19.9767, 0.09412),
    (20.0293, 0.01870),
    (20.0556, 0.0),
)
