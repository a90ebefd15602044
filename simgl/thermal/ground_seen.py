"""The Earth's surface along lines of sight: where they meet it, and its infrared light."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array, Mask
from simgl.physics.constants import SOLAR_TEMPERATURE, STEFAN_BOLTZMANN
from simgl.physics.earth_infrared import (
    Emission,
    InfraredAir,
    clear_transmission,
    earth_radiance,
    ground_temperature,
)
from simgl.scene.state import EarthState


@dataclass(frozen=True, kw_only=True, eq=False)
class GroundSeen:
    """What k lines of sight meet.

    met : (k,) whether it is the ground
    normal : (k, 3) of the ellipsoid there, Earth-fixed axes
    sun_cosine, view_cosine : (k,) of the angles of Sun and line of sight with it
    hour : (k,) local solar time there [h]
    """

    met: Mask
    normal: Array
    sun_cosine: Array
    view_cosine: Array
    hour: Array


def ground_seen(
    lines: Array, position: Array, earth: EarthState, sun_direction: Array
) -> GroundSeen:
    """Where lines of sight (k, 3), ICRF, from a position (3,) meet the Earth's ellipsoid."""
    turn = earth.R_itrf_from_icrf
    radii = np.asarray(earth.radii)
    ways = lines @ turn.T
    eye, scaled = (turn @ (position - earth.position)) / radii, ways / radii
    a = np.einsum("ki,ki->k", scaled, scaled)
    b = scaled @ eye
    inside = b * b - a * (eye @ eye - 1.0)
    met = (inside > 0.0) & (b < 0.0)
    distance = (-b - np.sqrt(np.maximum(inside, 0.0))) / a
    # The gradient of the ellipsoid's equation.
    normal = (eye + distance[:, None] * scaled) / radii
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    sun = turn @ sun_direction
    east = np.arctan2(normal[:, 1], normal[:, 0]) - np.arctan2(sun[1], sun[0])
    return GroundSeen(
        met=met,
        normal=normal,
        sun_cosine=normal @ sun,
        view_cosine=-np.einsum("ki,ki->k", normal, ways),
        hour=(12.0 + east * 12.0 / np.pi) % 24.0,
    )


def infrared_air(earth: EarthState, band: tuple[float, float]) -> InfraredAir:
    """The air and clouds of a scene's Earth in a band [m]."""
    clouds = earth.earth.clouds
    return InfraredAir(
        transmission=1.0 if earth.earth.air is None else clear_transmission(band),
        cloud_cover=0.0 if clouds is None else clouds.cover,
        cloud_height=0.0 if clouds is None else clouds.height,
    )


def ground_radiance(
    seen: GroundSeen, tai_ns: int, air: InfraredAir, emission: Emission, sunlight: float
) -> Array:
    """(k,) infrared radiance of the ground that is seen, 0 elsewhere.

    emission : radiance of a black body in the band, in any unit
    sunlight : the Sun's irradiance over all wavelengths [W m-2]
    """
    day = 1e-9 * tai_ns / 86400.0 % 365.2425
    temperature = ground_temperature(seen.normal[:, 2], day, seen.hour)
    emitted = earth_radiance(temperature, seen.view_cosine, air, emission)
    reflected = air.reflectance / np.pi * sunlight_in(emission, sunlight)
    radiance = emitted + reflected * np.maximum(seen.sun_cosine, 0.0)
    return np.where(seen.met, radiance, 0.0)


def sunlight_in(emission: Emission, sunlight: float) -> float:
    """Of the Sun's irradiance over all wavelengths [W m-2] what is in the band of ``emission``."""
    total = STEFAN_BOLTZMANN * SOLAR_TEMPERATURE**4 / np.pi
    return float(emission(np.array(SOLAR_TEMPERATURE)) / total) * sunlight
