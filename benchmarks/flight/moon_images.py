"""The Moon as satellites in geostationary orbit saw it, next to simgl's from the same place.

The imagers' axes and scan drift are unknown: simgl's image is laid over the measured one by the
affine map of the largest correlation.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import h5py
import moderngl
import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.optimize import minimize

from simgl.arrays import Array, Image8, Mask
from simgl.physics.constants import ASTRONOMICAL_UNIT, MOON_RADIUS
from simgl.physics.ephemeris import (
    itrf_from_icrf,
    moon_position,
    sun_position,
    tai_ns_from_utc,
)
from simgl.scenario.loader import scenario_from_dict
from simgl.simulator import Product, Simulator

# Pixels across simgl's image, and Moons across it.
_SIZE, _MOONS = 320, 1.1


@dataclass(frozen=True, kw_only=True, eq=False)
class MoonImage:
    """A measured image.

    utc : of the image
    place : (3,) of the satellite in ITRF [m]
    radiance : (height, width, channels) [W m-2 sr-1 um-1]
    irradiance : (channels,) of the disc [W m-2 um-1]
    radius : of the Moon in rows and columns [pixels]
    """

    utc: str
    place: Array
    radiance: Array
    irradiance: Array
    radius: tuple[float, float]


@dataclass(frozen=True, kw_only=True, eq=False)
class SeenMoon:
    """simgl's image from the same place.

    bands : (size, size, 4) radiance over the sunlight's irradiance
    reflectance : (4,) of the disc
    sun_distance : of the Moon [au]
    moon_distance : [m]
    """

    bands: Array
    reflectance: Array
    sun_distance: float
    moon_distance: float


def measured(file: Path) -> MoonImage:
    """An image of the Global Space-based Inter-Calibration System."""
    with h5py.File(file) as content:
        radiance = np.asarray(content["rad_obs_imgt"], dtype=np.float64)
        seconds = int(content["date"][0])
        place = 1e3 * np.asarray(content["sat_pos"], dtype=np.float64)
        irradiance = np.asarray(content["irr_obs"], dtype=np.float64)
        pixel = float(np.sqrt(content["pix_solid_ang"][0]))
        finer = float(content["ovrsamp_fa"][0])
    utc = str(np.datetime64(seconds, "s"))
    tai_ns = tai_ns_from_utc(utc)
    distance = np.linalg.norm(moon_position(tai_ns) - itrf_from_icrf(tai_ns).T @ place)
    rows = float(MOON_RADIUS / distance / pixel)
    return MoonImage(
        utc=utc,
        place=place,
        radiance=np.maximum(radiance, 0.0),
        irradiance=irradiance,
        radius=(rows, rows * finer),
    )


def rendered(gl: moderngl.Context, image: MoonImage) -> SeenMoon:
    """The same Moon by simgl, the Earth's north up."""
    tai_ns = tai_ns_from_utc(image.utc)
    place = itrf_from_icrf(tai_ns).T @ image.place
    offset = moon_position(tai_ns) - place
    distance = float(np.linalg.norm(offset))
    camera = {
        "position_icrf_m": place.tolist(),
        "boresight": (offset / distance).tolist(),
        "up": [0.0, 0.0, 1.0],
        "width_px": _SIZE,
        "height_px": _SIZE,
        "pixel_pitch_um": 5.0,
        "focal_length_mm": 5e-3 * _SIZE / (2.0 * _MOONS * MOON_RADIUS / distance),
    }
    data = {"epoch": {"utc": image.utc}, "camera": {"cam": camera}, "sky": {"stars": False}}
    scenario = scenario_from_dict(data | {"earth": {"shape": "none"}})
    state = scenario.at(tai_ns)
    assert state.moon is not None
    sun = state.sun.seen_from(state.moon)
    with Simulator(scenario, gl) as simulator:
        frame = simulator.capture(state, "cam", frozenset({Product.RADIANCE})).radiance
    assert frame is not None
    bands = frame.radiance.astype(np.float64) / sun.irradiance
    pixel = (2.0 * _MOONS / _SIZE) ** 2  # of the disc's radius squared
    return SeenMoon(
        bands=bands,
        reflectance=bands.sum(axis=(0, 1)) * pixel,
        sun_distance=float(np.linalg.norm(sun_position(tai_ns) - state.moon)) / ASTRONOMICAL_UNIT,
        moon_distance=distance,
    )


def disc_reflectance(image: MoonImage, channel: int, sunlight: float, seen: SeenMoon) -> float:
    """Measured reflectance of the disc; sunlight : of the channel at 1 au [W m-2 um-1]."""
    at_moon = sunlight / seen.sun_distance**2
    share = (MOON_RADIUS / seen.moon_distance) ** 2
    return float(image.irradiance[channel] / (at_moon * share))


@dataclass(frozen=True, kw_only=True, eq=False)
class Overlay:
    """A measured image and simgl's laid over it, 3 radii of the Moon wide.

    measured, shown : (n, n), each in a unit of its own
    correlation : of the frame
    """

    measured: Array
    shown: Array
    correlation: float

    @property
    def lit(self) -> Mask:
        """Where the Moon is lit."""
        return np.asarray(self.shown > 0.05 * self.shown.max())

    @property
    def correlation_of_lit(self) -> float:
        """Of the lit disc alone."""
        return float(np.corrcoef(self.shown[self.lit], self.measured[self.lit])[0, 1])

    @property
    def panels(self) -> dict[str, Image8]:
        """The measured image, simgl's, and measured over simgl's: grey where that is its median."""
        one, other = (
            image / np.percentile(image[self.lit], 99.0) for image in (self.measured, self.shown)
        )
        ratio = np.where(self.lit, self.measured / np.where(self.lit, self.shown, 1.0), 0.0)
        ratio /= 2.0 * np.median(ratio[self.lit])
        named = {"measured": one, "simgl": other, "ratio, 0 to 2": ratio}
        return {name: _grey(values) for name, values in named.items()}


def _grey(values: Array) -> Image8:
    codes = np.round(255.0 * np.clip(values, 0.0, 1.0)).astype(np.uint8)
    return np.repeat(codes[..., None], 3, axis=2)


def overlay(image: MoonImage, channel: int, seen: Array) -> Overlay:
    """A measured image and simgl's, as the affine map with the largest correlation lays it.

    seen : (size, size) one of simgl's bands
    """
    target = _about_the_moon(image.radiance[..., channel], image.radius)
    frame, laid = max((_laid_over(target, seen, turn) for turn in _TURNS), key=lambda one: one[0])
    return Overlay(measured=target, shown=laid, correlation=frame)


# Axes of simgl's image in radii of the Moon to start from: each corner of the frame first.
_TURNS = [
    flip @ np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    for flip in (np.eye(2), np.diag([-1.0, 1.0]))
    for a in np.radians(np.arange(0.0, 360.0, 45.0))
]
# Pixels of the measured image's copy per radius of the Moon.
_FINE = 48.0


def _about_the_moon(radiance: Array, radius: tuple[float, float]) -> Array:
    """The image about its middle of light, with square pixels, 3 radii wide."""
    bright = np.where(radiance > 0.1 * radiance.max(), radiance, 0.0)
    index = np.indices(radiance.shape)
    middle = [float((i * bright).sum() / bright.sum()) for i in index]
    step = [max(r / _FINE, 1.0) for r in radius]
    smooth = gaussian_filter(radiance, [0.5 * s if s > 1.0 else 0.0 for s in step])
    grid = np.indices((int(3.0 * _FINE),) * 2) / _FINE - 1.5
    places = [m + r * g for m, r, g in zip(middle, radius, grid, strict=True)]
    return np.asarray(map_coordinates(smooth, places, order=1, cval=0.0))


def _laid_over(target: Array, seen: Array, turn: Array) -> tuple[float, Array]:
    """The largest correlation near a start, and the image that has it."""
    smooth = gaussian_filter(seen, 0.4 * _SIZE / (2.0 * _MOONS) / _FINE)
    grid = np.indices(target.shape) / _FINE - 1.5
    index = np.indices(seen.shape)
    of_light = [(i * seen).sum() / seen.sum() for i in index]
    start = np.array([*((np.array(of_light) + 0.5) / _SIZE * 2.0 - 1.0) * _MOONS, *turn.ravel()])

    def laid(q: Array) -> Array:
        y = q[0] + q[2] * grid[0] + q[3] * grid[1]
        x = q[1] + q[4] * grid[0] + q[5] * grid[1]
        places = [(v / _MOONS + 1.0) * 0.5 * _SIZE - 0.5 for v in (y, x)]
        return np.asarray(map_coordinates(smooth, places, order=1, cval=0.0))

    def lost(q: Array) -> float:
        return -float(np.corrcoef(laid(q).ravel(), target.ravel())[0, 1])

    simplex = np.concatenate([start[None], start + 0.06 * np.eye(6)])
    options = {"initial_simplex": simplex, "maxiter": 500, "xatol": 1e-4, "fatol": 1e-6}
    best = minimize(lost, start, method="Nelder-Mead", options=options)
    return -float(best.fun), laid(best.x)
