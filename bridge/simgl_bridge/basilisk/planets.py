"""The planets as Basilisk names and sends them: position, shape and surface."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array
from simgl.errors import BridgeError
from simgl.physics.ephemeris import itrf_from_icrf
from simgl.physics.regolith import MARS, Regolith
from simgl.scenario.scenario import Scenario
from simgl.scene.earth import Earth
from simgl.scene.state import EarthState
from simgl_bridge.basilisk.viz_messages import CelestialBody

# Largest deviation from orthogonality of a rotation matrix from the wire.
_ROTATION_TOLERANCE = 1e-6
# Light travels this in 12 days [m]; beyond, float64 cannot hold the geometry of an image.
_FARTHEST = 3e14


class NoImageError(BridgeError):
    """This request has no image; the message says why in one line."""


@dataclass(frozen=True, kw_only=True)
class Spheroid:
    """Semi-axes [km] and surface of a planet.

    albedo : Lambert albedo in the bands R, G, B, N, or in all of them
    regolith : reflectance law in place of Lambert's
    """

    equatorial_km: float
    polar_km: float
    albedo: float | tuple[float, float, float, float]
    regolith: Regolith | None = None

    @property
    def globe(self) -> Earth:
        """The planet as simgl draws it."""
        albedo = (self.albedo,) * 4 if isinstance(self.albedo, float) else self.albedo
        return Earth(
            equatorial_radius=self.equatorial_km * 1e3,
            polar_radius=self.polar_km * 1e3,
            albedo=albedo,
            regolith=self.regolith,
        )


# Radii: IAU Working Group on Cartographic Coordinates 2015 (Archinal et al. 2018); giants at 1 bar.
# Albedos in R, G, B, N are 3/2 of the geometric ones, so that the full disc is as bright as in
# nature, from disc spectra in the package coronagraph 1.1, weighed by sunlight over the bands:
# Mars's the Virtual Planetary Laboratory's, raised by a fourteenth to 0.170 in V (NASA planetary
# fact sheet); the giants' measured (Karkoschka 1998, Icarus 133, 134), Saturn without its rings.
# Mercury and Venus: Bond albedos (NASA planetary fact sheets).
SPHEROIDS = {
    "mercury": Spheroid(equatorial_km=2440.53, polar_km=2438.26, albedo=0.068),
    "venus": Spheroid(equatorial_km=6051.8, polar_km=6051.8, albedo=0.77),
    "mars": Spheroid(
        equatorial_km=3396.19, polar_km=3376.20, albedo=(0.41, 0.25, 0.11, 0.45), regolith=MARS
    ),
    "jupiter": Spheroid(equatorial_km=71492.0, polar_km=66854.0, albedo=(0.79, 0.80, 0.68, 0.55)),
    "saturn": Spheroid(equatorial_km=60268.0, polar_km=54364.0, albedo=(0.83, 0.73, 0.51, 0.63)),
    "uranus": Spheroid(equatorial_km=25559.0, polar_km=24973.0, albedo=(0.50, 0.80, 0.87, 0.16)),
    "neptune": Spheroid(equatorial_km=24764.0, polar_km=24341.0, albedo=(0.38, 0.69, 0.86, 0.11)),
}
_ALBEDO_OF_OTHERS = 0.3


def vector_of(values: Sequence[float], name: str) -> Array:
    """(3,) vector from the wire; raises NoImageError with its name where it is none."""
    if len(values) != 3:
        raise NoImageError(f"{name} must have 3 numbers, got {len(values)}")
    vector = np.array(values, dtype=np.float64)
    if not np.all(np.abs(vector) < _FARTHEST):
        raise NoImageError(f"{name} must have numbers below {_FARTHEST:g}, got {vector.tolist()}")
    return vector


def plain_name(body: CelestialBody) -> str:
    """The first word in lower case: "Mars barycenter" is "mars"."""
    return re.split(r"[^a-z0-9]+", body.name.lower())[0]


def central_body(bodies: Sequence[CelestialBody], position: Array) -> CelestialBody | None:
    """The planet that looks largest from a position (3,) [m]; None without one."""
    largest, largest_ratio = None, 0.0
    for body in bodies:
        name = plain_name(body)
        if name in ("sun", "moon"):
            continue
        radius = 1e3 * (SPHEROIDS[name].equatorial_km if name in SPHEROIDS else body.radius_km)
        distance = float(np.linalg.norm(vector_of(body.position, body.name) - position))
        if name == "earth":
            radius = Earth().equatorial_radius
        if radius > 0.0 and radius / max(distance, 1.0) > largest_ratio:
            largest, largest_ratio = body, radius / max(distance, 1.0)
    return largest


def globe_of(body: CelestialBody, base: Scenario, tai_ns: int) -> EarthState:
    """A planet at the origin of the scene: simgl's own shape where its name is known."""
    name = plain_name(body)
    fallback = np.eye(3)
    if name == "earth":
        assert base.earth is not None
        globe, fallback = base.earth, itrf_from_icrf(tai_ns)
    else:
        ratio = body.radius_ratio if body.radius_ratio > 0.0 else 1.0
        sent = Spheroid(
            equatorial_km=body.radius_km,
            polar_km=body.radius_km * ratio,
            albedo=_ALBEDO_OF_OTHERS,
        )
        globe = SPHEROIDS.get(name, sent).globe
    return EarthState(
        earth=globe, position=np.zeros(3), R_itrf_from_icrf=rotation_of(body, fallback)
    )


def rotation_of(body: CelestialBody, fallback: Array) -> Array:
    """R_fixed_from_icrf (3, 3) as sent; the fallback where none was sent or all are zero."""
    if not any(body.rotation):
        return fallback
    R = np.array(body.rotation, dtype=np.float64)
    if R.shape == (9,) and np.all(np.abs(R) < 2.0):
        R = R.reshape(3, 3)
        deviation = float(np.abs(R @ R.T - np.eye(3)).max())
        if deviation < _ROTATION_TOLERANCE and np.linalg.det(R) > 0.0:
            return R
    raise NoImageError(f'"{body.name}" must have a rotation matrix, got {list(body.rotation)}')
