"""The Earth's light on the faces of a cube in low orbit, beside that of CERES's mean albedos.

A camera that sees the whole Earth from the orbit gives the radiance L of all directions d; a face
with the normal n receives the sum of L max(n d, 0) dw. The same sum over a Lambertian Earth, each
place with its mean albedo of a year, stands for the flight data: no weather of the day, no albedo
that grows as the Sun sinks, no directions in which clouds and sea are brighter.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np

from benchmarks.flight.distant_earth import DATES, ground_normals
from simgl.arrays import Array
from simgl.physics.constants import EARTH_MU, WGS84_EQUATORIAL_RADIUS
from simgl.physics.ephemeris import itrf_from_icrf, sun_position
from simgl.scenario.loader import scenario_from_dict
from simgl.simulator import Product, Simulator

# Of a space station's orbit [m, rad].
HEIGHT, INCLINATION = 400e3, np.radians(51.6)
# Of the cube's faces that see the Earth, in local-vertical axes: x ahead, y against the orbit's
# normal, z to nadir.
FACES = {
    "nadir": (0.0, 0.0, 1.0),
    "ahead": (1.0, 0.0, 0.0),
    "behind": (-1.0, 0.0, 0.0),
    "along the orbit's normal": (0.0, -1.0, 0.0),
    "against it": (0.0, 1.0, 0.0),
}
# The horizon lies 70.2 deg from nadir, the air's top 74 deg.
_SIZE, _HALF_FIELD = 160, np.radians(74.0)
# Orbits of a day, and places along each.
_ORBITS, _STEPS = 15, 8
# Beyond that from its middle pixels do not see the Sun's disc itself [rad].
_SUN = np.radians(0.7)


@dataclass(frozen=True, kw_only=True, eq=False)
class FaceLight:
    """Irradiance by the Earth, 400 to 1000 nm, over that of the Sun: means of orbits.

    simgl, mean_earth : (orbits, faces)
    """

    simgl: Array
    mean_earth: Array

    @property
    def ratios(self) -> Array:
        """(orbits, faces) simgl's over the mean Earth's."""
        return self.simgl / self.mean_earth


def _axes(along: float) -> tuple[Array, Array]:
    """(3,) position [m] and (3, 3) axes ahead, against the normal and to nadir as rows; ICRF.

    along : angle from the ascending node [rad]
    """
    radius = WGS84_EQUATORIAL_RADIUS + HEIGHT
    north = np.array([0.0, np.cos(INCLINATION), np.sin(INCLINATION)])
    up = np.cos(along) * np.array([1.0, 0.0, 0.0]) + np.sin(along) * north
    ahead = np.cos(along) * north - np.sin(along) * np.array([1.0, 0.0, 0.0])
    return radius * up, np.stack([ahead, -np.cross(up, ahead), -up])


def _rays() -> tuple[Array, Array]:
    """(size, size, 3) unit vectors to pixels in the axes of the orbit, and their solid angles."""
    edge = np.tan(_HALF_FIELD)
    tangent = ((np.arange(_SIZE) + 0.5) / _SIZE * 2.0 - 1.0) * edge
    # The camera has ahead on top, and the y axis to its right.
    ahead, right = np.meshgrid(-tangent, tangent, indexing="ij")
    rays = np.stack([ahead, right, np.ones_like(ahead)], axis=-1)
    length = np.linalg.norm(rays, axis=-1)
    solid = (2.0 * edge / _SIZE) ** 2 / length**3
    return rays / length[..., None], solid


def _camera(position: Array, axes: Array) -> dict[str, Any]:
    return {
        "position_icrf_m": position.tolist(),
        "boresight": axes[2].tolist(),
        "up": axes[0].tolist(),
        "width_px": _SIZE,
        "height_px": _SIZE,
        "pixel_pitch_um": 5.0,
        "focal_length_mm": 5e-3 * _SIZE / (2.0 * np.tan(_HALF_FIELD)),
    }


def _mean_earth(position: Array, rays: Array, sun: Array, albedo: Array) -> Array:
    """(size, size) radiance of a Lambertian Earth over the Sun's irradiance [sr-1]; ITRF.

    albedo : (180, 360) from the south pole and 180 deg west on
    """
    normal, meets = ground_normals(position, rays)
    latitude = np.degrees(np.arctan2(normal[..., 2], np.hypot(normal[..., 0], normal[..., 1])))
    longitude = np.degrees(np.arctan2(normal[..., 1], normal[..., 0]))
    row = np.clip(latitude + 90.0, 0.0, 179.5).astype(int)
    column = ((longitude + 180.0) % 360.0).astype(int)
    return np.asarray(albedo[row, column] * np.maximum(normal @ sun, 0.0) / np.pi * meets)


def cube_light(ctx: moderngl.Context, albedo: Array) -> FaceLight:
    """Of a day of orbits on each of the four dates, each with the weather of its own seed.

    albedo : (180, 360) of 400 to 1000 nm, mean of a year
    """
    rays, solid = _rays()
    weight = np.maximum(rays @ np.array(list(FACES.values())).T, 0.0) * solid[..., None]
    places = [_axes(along) for along in 2.0 * np.pi * np.arange(_STEPS) / _STEPS]
    period = 2.0 * np.pi * np.sqrt((WGS84_EQUATORIAL_RADIUS + HEIGHT) ** 3 / EARTH_MU)
    shape = len(DATES), _ORBITS, _STEPS, len(FACES)
    simgl, mean = np.zeros(shape), np.zeros(shape)
    for seed, date in enumerate(DATES):
        cameras = {str(k): _camera(*place) for k, place in enumerate(places)}
        earth = {"moonlight": False, "airglow": False, "clouds": {"seed": seed}}
        data = {"epoch": {"utc": f"{date}T00:00:00"}, "earth": earth, "camera": cameras}
        scenario = scenario_from_dict(data | {"sky": {"stars": False}})
        with Simulator(scenario, ctx) as simulator:
            for orbit, step in np.ndindex(_ORBITS, _STEPS):
                after = (orbit + step / _STEPS) * period
                state = scenario.at(scenario.epoch_tai_ns + round(after * 1e9))
                frame = simulator.capture(state, str(step), frozenset({Product.RADIANCE})).radiance
                assert frame is not None
                at = seed, orbit, step
                position, axes = places[step]
                sun = sun_position(state.tai_ns)
                sun /= np.linalg.norm(sun)
                off_disc = rays @ axes @ sun < np.cos(_SUN)
                light = frame.radiance.sum(axis=-1) * off_disc
                sunlight = float(state.sun.seen_from(np.zeros(3)).irradiance.sum())
                simgl[at] = np.einsum("yx,yxf->f", light, weight) / sunlight
                R = itrf_from_icrf(state.tai_ns)
                of_mean = _mean_earth(R @ position, rays @ axes @ R.T, R @ sun, albedo)
                mean[at] = np.einsum("yx,yxf->f", of_mean, weight)
    return FaceLight(
        simgl=simgl.mean(axis=2).reshape(-1, len(FACES)),
        mean_earth=mean.mean(axis=2).reshape(-1, len(FACES)),
    )
