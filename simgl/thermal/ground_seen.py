"""The Earth's surface along lines of sight: where they meet it, and its infrared light.

On the CPU, in closed form, for the light that it sends to a spacecraft; what stands behind it in an
image is drawn by simgl/passes/background/infrared_earth.py.
"""

from __future__ import annotations

from collections.abc import Sequence
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
from simgl.physics.spectrum import BANDS
from simgl.physics.thermal_radiation import band_fraction
from simgl.scene.frost import year_share
from simgl.scene.state import EarthState, SceneState
from simgl.thermal.network import SPACE_TEMPERATURE


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


def day_of_year(tai_ns: int) -> float:
    """Days since the year began."""
    return 365.2425 * year_share(tai_ns)


def sky_radiance(
    state: SceneState,
    position: Array,
    lines: Array,
    band: tuple[float, float],
    emissions: Sequence[Emission],
) -> Array:
    """(k, m) radiance in a band along lines of sight (k, 3), ICRF, from a position (3,): the Earth,
    and space beyond it.

    emissions : m radiances of a black body in the band, each in its unit
    """
    space = np.array([float(emission(np.array(SPACE_TEMPERATURE))) for emission in emissions])
    earth = state.earth
    if earth is None:
        return np.tile(space, (len(lines), 1))
    sun = state.sun.seen_from(earth.position)
    seen = ground_seen(lines, position, earth, sun.direction_icrf)
    air, sunlight = infrared_air(earth, band), total_sunlight(sun.irradiance)
    temperature = ground_temperature(seen.normal[:, 2], day_of_year(state.tai_ns), seen.hour)
    columns = []
    for emission, beyond in zip(emissions, space, strict=True):
        emitted = earth_radiance(temperature, seen.view_cosine, air, emission)
        reflected = air.reflectance / np.pi * sunlight_in(emission, sunlight)
        radiance = emitted + reflected * np.maximum(seen.sun_cosine, 0.0)
        columns.append(np.where(seen.met, radiance, beyond))
    return np.stack(columns, axis=1)


def total_sunlight(irradiance: Array) -> float:
    """The Sun's irradiance over all wavelengths of that in the bands (4,) [W m-2].

    The Sun is a black body of 5772 K: another temperature by 5 K changes this by 0.02 %.
    """
    edges = [edge for band in BANDS.edges for edge in band]
    share = float(band_fraction((min(edges), max(edges)), SOLAR_TEMPERATURE))
    return float(irradiance.sum()) / share


def sunlight_in(emission: Emission, sunlight: float) -> float:
    """Of the Sun's irradiance over all wavelengths [W m-2] what is in the band of ``emission``."""
    total = STEFAN_BOLTZMANN * SOLAR_TEMPERATURE**4 / np.pi
    return float(emission(np.array(SOLAR_TEMPERATURE)) / total) * sunlight
