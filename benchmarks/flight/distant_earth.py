"""The Earth from as far as the Moon: how much of the sunlight it reflects, by place and by phase.

A pixel of a distant camera holds the radiance L of a patch of projected area D^2 dw, dw being its
solid angle. Summed over cameras all around, the flux of a patch is the sum of L D^2 dw times the
cameras' share of the sphere. The Sun's direction is that of the epoch.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import moderngl
import numpy as np

from simgl.arrays import Array, Array32, IndexArray, Mask
from simgl.physics.constants import WGS84_EQUATORIAL_RADIUS, WGS84_POLAR_RADIUS
from simgl.physics.ephemeris import itrf_from_icrf, sun_position, tai_ns_from_utc
from simgl.scenario.loader import scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.scene.state import SceneState
from simgl.simulator import Product, Simulator

# Mean distance of the Moon [m].
DISTANCE = 384.4e6
# Edges of belts of latitude from the south [deg].
BELTS = (-90.0, -60.0, -30.0, 0.0, 30.0, 60.0, 90.0)
# Edge of the cells of latitude and longitude in which light is added up [deg].
CELL = 5.0
DATES = ("2018-03-20", "2018-06-21", "2018-09-23", "2018-12-21")

_SIZE = 160
# Across the frame [rad]; the Earth with its air spans 0.0336.
_FIELD = 0.0344
_SEMI_AXES = np.array([WGS84_EQUATORIAL_RADIUS, WGS84_EQUATORIAL_RADIUS, WGS84_POLAR_RADIUS])


# South, north, west and east edge of a part of the Earth [deg].
Box = tuple[float, float, float, float]

_SHAPE = round(180.0 / CELL), round(360.0 / CELL)


@dataclass(frozen=True, kw_only=True, eq=False)
class Reflected:
    """Means over epochs: what cells receive and send back [W], per band.

    received, sent : (36, 72, 4) from the south pole and 180 deg west on
    """

    received: Array
    sent: Array

    def of(self, box: Box) -> float:
        """Share of all that a part receives from 400 to 1000 nm."""
        south, north, west, east = box
        rows = slice(round((south + 90.0) / CELL), round((north + 90.0) / CELL))
        columns = slice(round((west + 180.0) / CELL), round((east + 180.0) / CELL))
        return float(self.sent[rows, columns].sum() / self.received[rows, columns].sum())

    @property
    def of_belts(self) -> Array:
        """(6,) the same of each belt."""
        return np.array(
            [self.of((south, north, -180.0, 180.0)) for south, north in pairwise(BELTS)]
        )

    @property
    def of_all(self) -> float:
        """The same of the Earth."""
        return self.of((-90.0, 90.0, -180.0, 180.0))


def _cell(latitude: Array, longitude: Array) -> IndexArray:
    """Index among all cells, of geodetic places [rad]."""
    row = np.clip(np.degrees(latitude) + 90.0, 0.0, 179.99) // CELL
    column = (np.degrees(longitude) + 180.0) % 360.0 // CELL
    return np.asarray(row * _SHAPE[1] + column).astype(np.intp).ravel()


def _over_cells(cell: IndexArray, values: Array) -> Array:
    """(36, 72, 4) sums of values (..., 4)."""
    flat = values.reshape(-1, 4).T
    size = _SHAPE[0] * _SHAPE[1]
    return np.stack([np.bincount(cell, band, size).reshape(_SHAPE) for band in flat], axis=-1)


def sphere_directions(count: int) -> Array:
    """(count, 3) unit vectors spread evenly, a Fibonacci lattice."""
    index = np.arange(count) + 0.5
    z = 1.0 - 2.0 * index / count
    turn = np.pi * (1.0 + np.sqrt(5.0)) * index
    across = np.sqrt(1.0 - z**2)
    return np.stack([across * np.cos(turn), across * np.sin(turn), z], axis=1)


def distant_camera(direction: Array) -> dict[str, Any]:
    """A camera as far as the Moon that looks at the Earth; direction : (3,) to it, ICRF."""
    up = np.eye(3)[int(np.argmin(abs(direction)))]
    return {
        "position_icrf_m": (DISTANCE * direction).tolist(),
        "boresight": (-direction).tolist(),
        "up": up.tolist(),
        "width_px": _SIZE,
        "height_px": _SIZE,
        "pixel_pitch_um": 5.0,
        "focal_length_mm": 5e-3 * _SIZE / (2.0 * np.tan(0.5 * _FIELD)),
    }


def earth_scenario(directions: Sequence[Array], clouds: dict[str, Any]) -> Scenario:
    """The Earth alone before cameras "0", "1", ... ; clouds : table of the scenario."""
    cameras = {str(i): distant_camera(direction) for i, direction in enumerate(directions)}
    earth: dict[str, Any] = {"moonlight": False, "airglow": False, "clouds": clouds}
    data = {"epoch": {"utc": f"{DATES[0]}T00:00:00"}, "earth": earth, "camera": cameras}
    return scenario_from_dict(data | {"sky": {"stars": False}})


def times_of_day(dates: Sequence[str], count: int) -> list[int]:
    """Epochs spread evenly over days [ns TAI]."""
    step = 86_400 * 10**9 // count
    return [tai_ns_from_utc(f"{date}T00:00:00") + k * step for date in dates for k in range(count)]


def pixel_solid_angles() -> Array:
    """(size, size) [sr]."""
    tangent = (np.arange(_SIZE) + 0.5 - _SIZE / 2) * 2.0 * np.tan(0.5 * _FIELD) / _SIZE
    pixel = (2.0 * np.tan(0.5 * _FIELD) / _SIZE) ** 2
    return np.asarray(pixel / (1.0 + tangent[:, None] ** 2 + tangent**2) ** 1.5)


def pixel_places(direction: Array, tai_ns: int) -> tuple[Array, Array]:
    """(size, size) geodetic latitude and longitude where pixels see the Earth, or pass it nearest
    [rad].

    direction : (3,) to the camera, ICRF
    """
    camera = distant_camera(direction)
    forward = np.array(camera["boresight"])
    up = np.array(camera["up"]) - np.dot(camera["up"], forward) * forward
    up /= np.linalg.norm(up)
    right = np.cross(forward, up)
    tangent = (np.arange(_SIZE) + 0.5 - _SIZE / 2) * 2.0 * np.tan(0.5 * _FIELD) / _SIZE
    ray = forward + tangent[None, :, None] * right - tangent[:, None, None] * up
    R = itrf_from_icrf(tai_ns)
    normal, _ = ground_normals(R @ (DISTANCE * direction), ray @ R.T)
    return np.arctan2(normal[..., 2], np.hypot(normal[..., 0], normal[..., 1])), np.arctan2(
        normal[..., 1], normal[..., 0]
    )


def ground_normals(position: Array, rays: Array) -> tuple[Array, Mask]:
    """(..., 3) normals where rays meet the ellipsoid, or pass it nearest, and which meet it; ITRF.

    position : (3,) of the camera [m]
    """
    start, ray = position / _SEMI_AXES, rays / _SEMI_AXES
    a, b, c = (ray**2).sum(-1), ray @ start, start @ start - 1.0
    discriminant = b**2 - a * c
    t = (-b - np.sqrt(np.maximum(discriminant, 0.0))) / a
    normal = (start + t[..., None] * ray) / _SEMI_AXES
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return normal, (discriminant > 0.0) & (b < 0.0)


def received_by_cells(tai_ns: int, irradiance: Array) -> Array:
    """(36, 72, 4) sunlight on cells [W]; irradiance : (4,) at the Earth [W m-2]."""
    steps = 720
    latitude = (np.arange(steps // 2) + 0.5) * 2.0 * np.pi / steps - 0.5 * np.pi
    sun = sun_position(tai_ns)
    sun = itrf_from_icrf(tai_ns) @ (sun / np.linalg.norm(sun))
    longitude = (np.arange(steps) + 0.5) * 2.0 * np.pi / steps - np.pi
    mu = (
        np.cos(latitude)[:, None]
        * np.cos(longitude - np.arctan2(sun[1], sun[0]))
        * np.hypot(sun[0], sun[1])
        + np.sin(latitude)[:, None] * sun[2]
    )
    # Of an ellipsoid's area per geodetic latitude and longitude.
    e2 = 1.0 - (WGS84_POLAR_RADIUS / WGS84_EQUATORIAL_RADIUS) ** 2
    area = WGS84_POLAR_RADIUS**2 * np.cos(latitude) / (1.0 - e2 * np.sin(latitude) ** 2) ** 2
    lit = np.maximum(mu, 0.0) * area[:, None] * (2.0 * np.pi / steps) ** 2
    cell = _cell(*np.meshgrid(latitude, longitude, indexing="ij"))
    return _over_cells(cell, lit[..., None] * irradiance)


def _frames(
    simulator: Simulator, scenario: Scenario, epochs: Sequence[int]
) -> Iterator[tuple[int, SceneState, int, Array32]]:
    for epoch in epochs:
        state = scenario.at(epoch)
        for i in range(len(state.cameras)):
            frame = simulator.capture(state, str(i), frozenset({Product.RADIANCE})).radiance
            assert frame is not None
            yield epoch, state, i, frame.radiance


def reflected(
    ctx: moderngl.Context, *, clouds: dict[str, Any], views: int = 48, hours: int = 4
) -> Reflected:
    """Means over four dates and some times of day, each with the weather of a seed of its own.

    What was measured are means of a year. Over few weathers a part of 15 deg would scatter by some
    hundredths.
    """
    directions = sphere_directions(views)
    solid = pixel_solid_angles()[..., None] * DISTANCE**2 * 4.0 * np.pi / views
    sent = np.zeros((*_SHAPE, 4))
    received = np.zeros_like(sent)
    epochs = times_of_day(DATES, hours)
    for seed, epoch in enumerate(epochs):
        scenario = earth_scenario(list(directions), clouds | {"seed": seed})
        with Simulator(scenario, ctx) as simulator:
            for _, state, i, radiance in _frames(simulator, scenario, [epoch]):
                if i == 0:
                    sunlight = state.sun.seen_from(np.zeros(3)).irradiance
                    received += received_by_cells(epoch, sunlight)
                sent += _over_cells(_cell(*pixel_places(directions[i], epoch)), solid * radiance)
    return Reflected(received=received / len(epochs), sent=sent / len(epochs))


def noon_discs(ctx: moderngl.Context, longitudes: Sequence[float]) -> Array:
    """(longitudes,) light of the full Earth over a longitude [deg] at its noon, relative to the
    mean of them, in all bands; mean over the dates, as in ``reflected``."""
    solid = pixel_solid_angles()
    light = np.zeros(len(longitudes))
    for seed, date in enumerate(DATES):
        start = tai_ns_from_utc(f"{date}T00:00:00")
        for k, east in enumerate(longitudes):
            epoch = start + round((12.0 - east / 15.0) % 24.0 * 3600e9)
            above = np.array([np.cos(np.radians(east)), np.sin(np.radians(east)), 0.0])
            scenario = earth_scenario([itrf_from_icrf(epoch).T @ above], {"seed": seed})
            with Simulator(scenario, ctx) as simulator:
                for _, _, _, radiance in _frames(simulator, scenario, [epoch]):
                    light[k] += np.einsum("yxb,yx->", radiance, solid)
    return light / light.mean()


def apparent_albedo(
    ctx: moderngl.Context,
    *,
    phases: Sequence[float],
    hours: int = 12,
    dates: Sequence[str] = DATES,
) -> Array:
    """(phases, epochs, 4) p* as earthshine is reduced (Goode et al. 2001, eq. 4), with the weather
    of a seed for each epoch.

    The Earth's light towards the camera over that of a Lambert sphere of albedo 1 and its mean
    radius at the same phase [deg].
    """
    epochs = times_of_day(dates, hours)
    solid = pixel_solid_angles()
    result = np.zeros((len(phases), len(epochs), 4))
    for k, epoch in enumerate(epochs):
        sun = sun_position(epoch)
        sun /= np.linalg.norm(sun)
        across = np.cross([0.0, 0.0, 1.0], sun)
        across /= np.linalg.norm(across)
        a = np.radians(np.asarray(phases))[:, None]
        directions = np.cos(a) * sun + np.sin(a) * across
        scenario = earth_scenario(list(directions), {"seed": k})
        with Simulator(scenario, ctx) as simulator:
            for _, state, i, radiance in _frames(simulator, scenario, [epoch]):
                alpha = np.radians(phases[i])
                lambert = 2.0 / (3.0 * np.pi) * (np.sin(alpha) + (np.pi - alpha) * np.cos(alpha))
                sunlight = state.sun.seen_from(np.zeros(3)).irradiance
                full = sunlight * (6371.0e3 / DISTANCE) ** 2 * lambert
                result[i, k] = np.einsum("yxb,yx->b", radiance, solid) / full
    return result
