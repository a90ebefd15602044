"""Physical constants, each with its source."""

from __future__ import annotations

# CODATA 2018, exact by definition of the SI.
PLANCK = 6.62607015e-34  # [J s]
LIGHT_SPEED = 299792458.0  # [m s-1]
BOLTZMANN = 1.380649e-23  # [J K-1]
STEFAN_BOLTZMANN = 5.670374419e-8  # [W m-2 K-4] CODATA 2018

ASTRONOMICAL_UNIT = 149597870700.0  # [m] IAU 2012 resolution B2
SOLAR_RADIUS = 6.957e8  # [m] IAU 2015 resolution B3, nominal
SOLAR_CONSTANT = 1361.0  # [W m-2] total, at 1 au (IAU 2015 nominal; Kopp & Lean 2011)
SOLAR_TEMPERATURE = 5772.0  # [K] effective (IAU 2015 nominal)

WGS84_EQUATORIAL_RADIUS = 6378137.0  # [m] NIMA TR8350.2
WGS84_POLAR_RADIUS = 6356752.314245  # [m] derived from 1/f = 298.257223563
MOON_RADIUS = 1737.4e3  # [m] mean (IAU WGCCRE 2015)
EARTH_MU = 3.986004418e14  # [m3 s-2] NIMA TR8350.2
EARTH_ROTATION_RATE = 7.292115e-5  # [rad s-1] against the stars, NIMA TR8350.2
EARTH_J2 = 1.0826266836e-3  # EGM96, from its normalised C20
