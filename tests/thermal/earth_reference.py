"""The infrared Earth without clouds, written a second time: what shaders/infrared_earth draws."""

from __future__ import annotations

from typing import Any

import numpy as np

from simgl.physics.constants import STEFAN_BOLTZMANN, WGS84_EQUATORIAL_RADIUS
from simgl.physics.earth_infrared import Emission, clear_transmission
from simgl.scene.frost import year_share
from simgl.scene.state import SceneState

Array = np.ndarray[Any, np.dtype[np.float64]]


def earth_radiance(
    state: SceneState, position: Array, lines: Array, band: tuple[float, float], emission: Emission
) -> Array:
    """(k,) radiance in a band along lines of sight (k, 3), ICRF, from a position; 0 beside it."""
    earth = state.earth
    assert earth is not None
    sun = state.sun.seen_from(earth.position)
    turn, radii = earth.R_itrf_from_icrf, np.asarray(earth.radii)
    ways = lines @ turn.T
    eye, scaled = (turn @ (position - earth.position)) / radii, ways / radii
    a = np.einsum("ki,ki->k", scaled, scaled)
    b = scaled @ eye
    inside = b * b - a * (eye @ eye - 1.0)
    distance = (-b - np.sqrt(np.maximum(inside, 0.0))) / a
    normal = (eye + distance[:, None] * scaled) / radii
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    towards_sun = turn @ sun.direction_icrf
    view = -np.einsum("ki,ki->k", normal, ways)
    ground = _ground_temperature(normal, towards_sun, state.tai_ns)
    # An exponential layer of 2.5 km around a sphere.
    grazing = np.sqrt(0.5 * np.pi * WGS84_EQUATORIAL_RADIUS / 2.5e3)
    path = clear_transmission(band) ** (1.0 / np.sqrt(view**2 + grazing**-2))
    emitted = path * emission(ground) + (1.0 - path) * emission(ground - 20.0)
    # A black body of 5772 K has 0.5958 of its power from 400 to 1000 nm.
    total = float(sun.irradiance.sum()) / 0.595776
    share = float(emission(np.array(5772.0))) / (STEFAN_BOLTZMANN * 5772.0**4 / np.pi)
    reflected = 0.1 / np.pi * share * total * np.maximum(normal @ towards_sun, 0.0)
    return np.where((inside > 0.0) & (b < 0.0), emitted + reflected, 0.0)


def _ground_temperature(normal: Array, sun: Array, tai_ns: int) -> Array:
    x = normal[:, 2]
    day = 365.2425 * year_share(tai_ns)
    season = np.cos(2.0 * np.pi * (day - 205.0) / 365.2425)
    zonal = 288.1 - 14.0 * (3.0 * x * x - 1.0) + 10.0 * x * season
    east = np.arctan2(normal[:, 1], normal[:, 0]) - np.arctan2(sun[1], sun[0])
    return zonal + 4.0 * np.sqrt(1.0 - x * x) * np.cos(east - np.radians(30.0))
