"""Geometry of one frame: Sun, Earth and orbit about a target and the camera that looks at it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import erfa
import numpy as np

from simgl.arrays import Array
from simgl.physics.frames import angle_between, cross, lvlh_from_icrf, unit
from simgl.scene.state import EarthState, SceneState

# A target slower than this [m s-1] is no satellite: it has no orbit plane.
_SLOWEST_ORBIT = 100.0


@dataclass(frozen=True, kw_only=True)
class FrameGeometry:
    """Where things are at one epoch; None for what the scene does not have.

    camera_sunlight : share of the Sun's light that reaches the camera
    earth_limb_angle : from the Earth's limb to the boresight, negative where it points at the Earth
        [rad]
    beta_angle : of the Sun over the plane of the target's orbit, positive on the side of the orbit
        normal [rad]
    latitude, longitude : geodetic, below the target, longitude positive to the east [rad]
    altitude : of the target over the ellipsoid [m]
    camera_lvlh : (3,) of the camera from the target in its LVLH axes [m]
    boresight_lvlh : (3,) unit, in the same axes
    sun_lvlh : (3,) unit, from the target towards the Sun in the same axes
    """

    camera_sunlight: float
    earth_limb_angle: float | None = None
    beta_angle: float | None = None
    latitude: float | None = None
    longitude: float | None = None
    altitude: float | None = None
    camera_lvlh: tuple[float, float, float] | None = None
    boresight_lvlh: tuple[float, float, float] | None = None
    sun_lvlh: tuple[float, float, float] | None = None


def frame_geometry(state: SceneState, camera: str, target: str) -> FrameGeometry:
    """The geometry of a scene for a camera and a target that are in it."""
    seen, pose = state.cameras[camera], state.bodies[target].pose
    sunlight = state.sunlit_share(seen.position)
    if state.earth is None:
        return FrameGeometry(camera_sunlight=sunlight)
    boresight = seen.R_camera_from_icrf[2]
    offset = pose.position - state.earth.position
    latitude, longitude, altitude = _geodetic(state.earth, offset)
    place = FrameGeometry(
        camera_sunlight=sunlight,
        earth_limb_angle=_limb_angle(state.earth, seen.position, boresight),
        latitude=latitude,
        longitude=longitude,
        altitude=altitude,
    )
    if np.linalg.norm(pose.velocity) < _SLOWEST_ORBIT:
        return place
    sun = state.sun.seen_from(pose.position).direction_icrf
    normal = unit(cross(offset, pose.velocity))
    R_lvlh_from_icrf = lvlh_from_icrf(offset, pose.velocity)
    return replace(
        place,
        beta_angle=math.asin(float(np.clip(normal @ sun, -1.0, 1.0))),
        camera_lvlh=_three(R_lvlh_from_icrf @ (seen.position - pose.position)),
        boresight_lvlh=_three(R_lvlh_from_icrf @ boresight),
        sun_lvlh=_three(R_lvlh_from_icrf @ sun),
    )


def _limb_angle(earth: EarthState, position: Array, boresight: Array) -> float:
    """See ``FrameGeometry``; of the ellipsoid as a sphere in stretched axes, within 0.2 deg."""
    radii = np.array(earth.radii)
    scale = radii[0] / radii
    start = scale * (earth.R_itrf_from_icrf @ (position - earth.position))
    along = scale * (earth.R_itrf_from_icrf @ boresight)
    height = float(np.linalg.norm(start))
    radius = math.asin(min(radii[0] / height, 1.0))
    return angle_between(-start, along) - radius


def _geodetic(earth: EarthState, offset: Array) -> tuple[float, float, float]:
    """Latitude [rad], longitude [rad] and height [m] of a place from the Earth's centre [m]."""
    equatorial, _, polar = earth.radii
    flattening = 1.0 - polar / equatorial
    place = earth.R_itrf_from_icrf @ offset
    longitude, latitude, height = erfa.gc2gde(equatorial, flattening, place)
    return float(latitude), float(longitude), float(height)


def _three(vector: Array) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z
