"""The aurora: where its oval stands, how bright it is, and at which heights it shines.

Places are in magnetic latitude and local time (altitude-adjusted corrected geomagnetic coordinates,
Shepherd 2014). In each hemisphere an affine map of the unit vector of a place, fitted to AACGM-v2
for 2025 at 110 km and latitudes beyond 52 deg, is within 0.2 deg (north) and 0.4 deg (south) rms of
it, at most 1.7 deg.

The oval's edges by magnetic local time are those of Starkov (1994, Geomagnetism and Aeronomy 34,
331), for the index AL that goes with Kp (Sigernes et al. 2011, J. Space Weather Space Clim. 1).
The power of a hemisphere's precipitation follows Kp (Zhang and Paxton 2008, J. Atmos. Sol.-Terr.
Phys. 70, 1231). A flux of 1 mW m-2 gives 1.6 kR at 557.7 nm: the international brightness
coefficients of 1, 10, 100, 1000 kR for 0.6 to 600 mW m-2 (Chamberlain 1961; Vallance Jones 1974);
and 0.21 kR at 427.8 nm (Rees and Luckey 1974), 3.28 times that at 391.4 nm, which has the same
upper state. Red is 0.2 kR at 630 nm, for electrons of 3 keV, and a third of that at 636 nm. The
bands of N2 and N2+ from 600 to 1000 nm are estimates within a factor of two, without a source.

Where the arcs stand is made up: they lie in the oval, in place in magnetic latitude and local time.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from simgl.arrays import Array
from simgl.physics.airglow import RAYLEIGH
from simgl.physics.constants import LIGHT_SPEED, PLANCK
from simgl.physics.spectrum import BANDS, CHANNELS, Bands

# Magnetic unit vectors from geographic ones, north and south: matrix and shift.
_NORTH = (
    ((0.3323, -0.8305, -0.1036), (1.0316, 0.2437, -0.0023), (0.021, -0.1122, 1.0531)),
    (0.0136, 0.0157, -0.0725),
)
_SOUTH = (
    ((0.3362, -1.036, -0.3194), (1.0193, 0.3499, -0.1976), (-0.0501, -0.127, 0.8376)),
    (-0.0266, -0.1071, -0.2587),
)
# The dipole's north pole of 2025, from which the Sun's magnetic longitude counts [deg].
_POLE = (80.8, -72.8)

# Of Starkov's edges by log10 |AL|: mean colatitude and amplitudes [deg], phases [h]; the edge
# towards the pole, towards the equator, and that of the diffuse aurora.
_STARKOV = np.array(
    [
        [
            (-0.07, 24.54, -12.53, 2.15),
            (-10.06, 19.83, -9.33, 1.24),
            (-6.61, 10.17, -5.80, 1.19),
            (-4.44, 7.47, -3.01, 0.25),
            (6.37, -1.10, 0.34, -0.38),
            (-3.77, 7.90, -4.73, 0.91),
            (-4.48, 10.16, -5.87, 0.98),
        ],
        [
            (1.16, 23.21, -10.97, 2.03),
            (-9.59, 17.78, -7.20, 0.96),
            (-2.22, 1.50, -0.58, 0.08),
            (-12.07, 17.49, -7.96, 1.15),
            (-23.98, 42.79, -26.96, 5.56),
            (-6.56, 11.44, -6.73, 1.31),
            (-20.07, 36.67, -24.20, 5.11),
        ],
        [
            (3.44, 29.77, -16.38, 3.35),
            (-2.41, 7.89, -4.32, 0.87),
            (-1.68, -2.48, 1.58, -0.28),
            (-0.74, 3.94, -3.09, 0.72),
            (8.69, -20.73, 13.03, -2.14),
            (-2.12, 3.24, -1.67, 0.31),
            (8.61, -5.34, -1.36, 0.76),
        ],
    ]
)

# Wavelength [m], brightness for 1 mW m-2 [R], whether it shines at the heights of oxygen's red.
_LINES = np.array(
    [
        (557.7e-9, 1600.0, 0.0),  # O I
        (391.4e-9, 690.0, 0.0),  # N2+
        (427.8e-9, 210.0, 0.0),  # N2+
        (630.0e-9, 200.0, 1.0),  # O I
        (636.4e-9, 66.0, 1.0),  # O I
        (660e-9, 800.0, 0.0),  # N2, first positive bands
        (850e-9, 4000.0, 0.0),  # N2 and N2+, first positive and Meinel bands
    ]
)
# Edges of the layers in which it shines evenly [m].
HEIGHTS = 1e3 * np.array(
    [
        95.0,
        100.0,
        105.0,
        110.0,
        116.0,
        124.0,
        135.0,
        150.0,
        170.0,
        195.0,
        225.0,
        260.0,
        300.0,
        350.0,
    ]
)
# Chapman layers: height of the maximum, scale height there and its gradient above [m, m, 1].
_GREEN, _RED = (110e3, 7e3, 0.14), (235e3, 38e3, 0.0)
# Share of the light in arcs; the rest is spread over the oval.
ARC_SHARE = 0.35
# Flux over its mean at the inner edge of the diffuse aurora, beyond the oval.
RIM = 0.08


@dataclass(frozen=True, kw_only=True, eq=False)
class Oval:
    """Edges of the oval by the angle t of magnetic local time from midnight.

    edges : (3, 7) of the colatitude [rad]: mean, then cosines and sines of t, 2 t, 3 t; the edge
        towards the pole, towards the equator, and that of the diffuse aurora
    """

    edges: Array

    def colatitudes(self, local_time: Array) -> Array:
        """(3, n) of the edges [rad]; local_time : (n,) [h]."""
        turn = np.radians(15.0 * np.asarray(local_time))
        waves = [np.ones_like(turn)]
        for k in (1, 2, 3):
            waves += [np.cos(k * turn), np.sin(k * turn)]
        return np.asarray(self.edges @ np.stack(waves))


@lru_cache(maxsize=16)
def oval(kp: float) -> Oval:
    """Of a magnetic activity Kp, 0 to 9."""
    al = 18.0 - 12.3 * kp + 27.2 * kp**2 - 2.0 * kp**3
    terms = _STARKOV @ np.log10(al) ** np.arange(4)
    edges = np.zeros((3, 7))
    edges[:, 0] = np.radians(terms[:, 0])
    for k in (1, 2, 3):
        amplitude, phase = np.radians(terms[:, 2 * k - 1]), np.radians(15.0 * terms[:, 2 * k])
        edges[:, 2 * k - 1] = amplitude * np.cos(phase)
        edges[:, 2 * k] = -amplitude * np.sin(phase)
    edges.flags.writeable = False
    return Oval(edges=edges)


def hemispheric_power(kp: float) -> float:
    """Of the particles that come down in a hemisphere [W]."""
    if kp <= 5.0:
        return 1e9 * (38.66 * float(np.exp(0.1967 * kp)) - 33.99)
    return 1e9 * (4.592 * float(np.exp(0.4731 * kp)) + 20.47)


def magnetic_maps() -> Array:
    """(2, 3, 4) matrices and shifts that take unit vectors to magnetic ones, north and south.

    Their images are to be normalised.
    """
    return np.array([np.hstack([m, np.array(s)[:, None]]) for m, s in (_NORTH, _SOUTH)])


def midnight(sun_direction_itrf: Array) -> float:
    """Magnetic longitude of local midnight [rad]."""
    latitude, longitude = np.radians(_POLE)
    pole = np.array(
        [
            np.cos(latitude) * np.cos(longitude),
            np.cos(latitude) * np.sin(longitude),
            np.sin(latitude),
        ]
    )
    east = np.cross([0.0, 0.0, 1.0], pole)
    east /= np.linalg.norm(east)
    # Magnetic longitude 0 points away from the pole, south along its meridian.
    sun = np.asarray(sun_direction_itrf)
    return float(np.arctan2(sun @ east, sun @ np.cross(east, pole))) + np.pi


def brightness(bands: Bands = BANDS) -> Array:
    """(2, 4) zenith radiance for 1 W m-2 of particles [sr-1], of green and of red heights."""
    result = np.zeros((2, CHANNELS))
    for wavelength, rayleighs, red in _LINES:
        power = 1e3 * rayleighs * RAYLEIGH * PLANCK * LIGHT_SPEED / wavelength
        for index, (low, high) in enumerate(bands.edges):
            if low <= wavelength < high:
                result[int(red), index] += power * float(
                    bands.transmission(np.array([wavelength]))[0]
                )
    return result


def _chapman(heights: Array, law: tuple[float, float, float]) -> Array:
    peak, scale, gradient = law
    z = (heights - peak) / (scale + gradient * np.maximum(heights - peak, 0.0))
    return np.asarray(np.exp(1.0 - z - np.exp(-z)))


def layers() -> Array:
    """(2, n) share of the light in each of the layers, green and red heights."""
    fine = np.linspace(HEIGHTS[0], HEIGHTS[-1], 2551)
    middle = 0.5 * (fine[1:] + fine[:-1])
    layer = np.searchsorted(HEIGHTS, middle) - 1
    shares = [np.bincount(layer, _chapman(middle, law), len(HEIGHTS) - 1) for law in (_GREEN, _RED)]
    return np.array([one / one.sum() for one in shares])


@lru_cache(maxsize=16)
def mean_flux(kp: float) -> float:
    """Of particles over the oval, weighted as ``by_local_time`` says [W m-2]."""
    hours = np.linspace(0.0, 24.0, 96, endpoint=False)
    pole_side, equator_side, faint = np.cos(oval(kp).colatitudes(hours))
    radius = 6371e3 + HEIGHTS[3]
    ring = radius**2 * 2.0 * np.pi / len(hours)
    bright = float(np.sum((pole_side - equator_side) * by_local_time(hours)))
    rim = RIM * 0.5 * (1.0 - ARC_SHARE) * float(np.sum(equator_side - faint))
    return hemispheric_power(kp) / (ring * (bright + rim))


def by_local_time(hours: Array) -> Array:
    """Flux over its mean: most before midnight, as images from space show."""
    return np.asarray(1.0 + 0.6 * np.cos(np.radians(15.0 * (hours - 22.5))))
