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

# Light past the lighting study's atmosphere, seen from 500 km over the same sphere: (tangent height
# of the Sun's centre [km], red, green, blue share). Uniform disc, no refraction. Source: a Monte
# Carlo of that atmosphere with air up to 100 km, made independently of this code.
REDDENED = (
    (-10.0, 0.0003, 0.0, 0.0),
    (-5.0, 0.0189, 0.0017, 0.0),
    (0.0, 0.0857, 0.0165, 0.0005),
    (5.0, 0.2104, 0.0675, 0.0073),
    (10.0, 0.3823, 0.1723, 0.0393),
    (15.0, 0.5692, 0.3279, 0.1194),
    (20.0, 0.7252, 0.5085, 0.2547),
    (25.0, 0.8365, 0.6757, 0.4292),
    (30.0, 0.9072, 0.8028, 0.6072),
    (40.0, 0.9721, 0.9368, 0.8553),
    (60.0, 0.9977, 0.9946, 0.9869),
)
