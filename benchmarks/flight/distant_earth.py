"""The Earth from as far as the Moon: how much of the sunlight it reflects, by belts and by phase.

A pixel of a distant camera holds the radiance L of a patch of projected area D^2 dw, dw being its
solid angle. Summed over cameras all around, the flux of a patch is the sum of L D^2 dw times the
cameras' share of the sphere. The Sun's direction is that of the epoch.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np

from simgl.arrays import Array, Array32
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
DATES = ("2018-03-20", "2018-06-21", "2018-09-23", "2018-12-21")

_SIZE = 160
# Across the frame [rad]; the Earth with its air spans 0.0336.
_FIELD = 0.0344
_SEMI_AXES = np.array([WGS84_EQUATORIAL_RADIUS, WGS84_EQUATORIAL_RADIUS, WGS84_POLAR_RADIUS])


@dataclass(frozen=True, kw_only=True, eq=False)
class Reflected:
    """Means over epochs: what belts receive and send back [W], per band.

    received, sent : (6, 4)
    """

    received: Array
    sent: Array

    @property
    def albedo(self) -> Array:
        """(6, 4) of each belt and band."""
        return self.sent / self.received

    def over_bands(self, belts: slice = slice(None)) -> float:
        """Share of all that some belts receive from 400 to 1000 nm."""
        return float(self.sent[belts].sum() / self.received[belts].sum())

    @property
    def of_belts(self) -> Array:
        """(6,) the same of each belt."""
        return self.sent.sum(axis=1) / self.received.sum(axis=1)


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


def earth_scenario(directions: Sequence[Array], clouds: dict[str, Any] | None) -> Scenario:
    """The Earth alone before cameras "0", "1", ... ; clouds : table of the scenario."""
    cameras = {str(i): distant_camera(direction) for i, direction in enumerate(directions)}
    earth: dict[str, Any] = {"moonlight": False, "airglow": False}
    if clouds is not None:
        earth |= {"clouds": clouds}
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


def pixel_latitudes(direction: Array, tai_ns: int) -> Array:
    """(size, size) geodetic latitude where pixels see the Earth, or pass it nearest [rad].

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
    start, ray = R @ (DISTANCE * direction) / _SEMI_AXES, ray @ R.T / _SEMI_AXES
    a, b, c = (ray**2).sum(-1), ray @ start, start @ start - 1.0
    t = (-b - np.sqrt(np.maximum(b**2 - a * c, 0.0))) / a
    normal = (start + t[..., None] * ray) / _SEMI_AXES
    return np.arctan2(normal[..., 2], np.hypot(normal[..., 0], normal[..., 1]))


def received_by_belts(tai_ns: int, irradiance: Array) -> Array:
    """(6, 4) sunlight on belts [W]; irradiance : (4,) at the Earth [W m-2]."""
    steps = 720
    latitude = (np.arange(steps // 2) + 0.5) * 2.0 * np.pi / steps - 0.5 * np.pi
    sun = sun_position(tai_ns)
    sun = itrf_from_icrf(tai_ns) @ (sun / np.linalg.norm(sun))
    longitude = np.arange(steps) * 2.0 * np.pi / steps
    mu = (
        np.cos(latitude)[:, None]
        * np.cos(longitude - np.arctan2(sun[1], sun[0]))
        * np.hypot(sun[0], sun[1])
        + np.sin(latitude)[:, None] * sun[2]
    )
    # Of an ellipsoid's area per geodetic latitude and longitude.
    e2 = 1.0 - (WGS84_POLAR_RADIUS / WGS84_EQUATORIAL_RADIUS) ** 2
    area = WGS84_POLAR_RADIUS**2 * np.cos(latitude) / (1.0 - e2 * np.sin(latitude) ** 2) ** 2
    lit = np.maximum(mu, 0.0).sum(axis=1) * area * (2.0 * np.pi / steps) ** 2
    belt = np.digitize(np.degrees(latitude), BELTS[1:-1])
    return np.outer(np.bincount(belt, lit, len(BELTS) - 1), irradiance)


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
    ctx: moderngl.Context, *, clouds: dict[str, Any] | None, views: int = 48, hours: int = 4
) -> Reflected:
    """Means over four dates and some times of day."""
    directions = sphere_directions(views)
    scenario = earth_scenario(list(directions), clouds)
    epochs = times_of_day(DATES, hours)
    solid = pixel_solid_angles() * DISTANCE**2 * 4.0 * np.pi / views
    sent = np.zeros((len(BELTS) - 1, 4))
    received = np.zeros_like(sent)
    with Simulator(scenario, ctx) as simulator:
        for epoch, state, i, radiance in _frames(simulator, scenario, epochs):
            if i == 0:
                received += received_by_belts(epoch, state.sun.seen_from(np.zeros(3)).irradiance)
            belt = np.digitize(np.degrees(pixel_latitudes(directions[i], epoch)), BELTS[1:-1])
            for band in range(4):
                sent[:, band] += np.bincount(
                    belt.ravel(), (solid * radiance[..., band]).ravel(), len(BELTS) - 1
                )
    return Reflected(received=received / len(epochs), sent=sent / len(epochs))


def apparent_albedo(
    ctx: moderngl.Context,
    *,
    phases: Sequence[float],
    clouds: dict[str, Any] | None,
    hours: int = 12,
    dates: Sequence[str] = DATES,
) -> Array:
    """(phases, epochs, 4) p* as earthshine is reduced (Goode et al. 2001, eq. 4).

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
        scenario = earth_scenario(list(directions), clouds)
        with Simulator(scenario, ctx) as simulator:
            for _, state, i, radiance in _frames(simulator, scenario, [epoch]):
                alpha = np.radians(phases[i])
                lambert = 2.0 / (3.0 * np.pi) * (np.sin(alpha) + (np.pi - alpha) * np.cos(alpha))
                sunlight = state.sun.seen_from(np.zeros(3)).irradiance
                full = sunlight * (6371.0e3 / DISTANCE) ** 2 * lambert
                result[i, k] = np.einsum("yxb,yx->b", radiance, solid) / full
    return result
