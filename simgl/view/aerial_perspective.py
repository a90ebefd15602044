"""The air between a camera and a spacecraft, where one of them, or the way between, lies in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array
from simgl.physics.air_profile import AIR_TOP
from simgl.physics.frames import norm
from simgl.scene.earth import Earth
from simgl.scene.state import EarthState, SceneState


@dataclass(frozen=True, kw_only=True, eq=False)
class AirSegment:
    """A stretch of a ray inside the air, measured from its lowest point, float64.

    height : of that point [m]
    mu, mu_sun : cosines of the view direction and the Sun's from the zenith there
    nu : cosine between the two
    near, far : from that point to where the stretch begins (<= 0) and ends (>= 0) [m]
    sun_irradiance : (4,) above the air [W m-2]
    """

    earth: Earth
    height: float
    mu: float
    mu_sun: float
    nu: float
    near: float
    far: float
    sun_irradiance: Array


def air_between(state: SceneState, camera: Array, point: Array) -> AirSegment | None:
    """The air on the straight way from a camera to a point (3,) [m]; None where there is none."""
    if state.earth is None or state.earth.earth.air is None:
        return None
    earth = state.earth.earth
    start, end = (_in_sphere(state.earth, place) for place in (camera, point))
    length = norm(end - start)
    if length == 0.0:
        return None
    view = (end - start) / length
    # From the point of the whole line that lies nearest to the Earth's centre.
    first = float(np.dot(start, view))
    nearest = start - first * view
    reach = (earth.equatorial_radius + AIR_TOP) ** 2 - float(np.dot(nearest, nearest))
    if reach <= 0.0:
        return None
    low, high = max(first, -np.sqrt(reach)), min(first + length, np.sqrt(reach))
    if low >= high:
        return None
    at = min(max(0.0, low), high)
    lowest = nearest + at * view
    r = norm(lowest)
    sun = state.sun.seen_from(state.earth.position)
    radii = np.array(earth.radii)
    towards = radii[0] / radii * (state.earth.R_itrf_from_icrf @ sun.direction_icrf)
    towards /= norm(towards)
    return AirSegment(
        earth=earth,
        height=r - earth.equatorial_radius,
        mu=float(np.dot(lowest, view)) / r,
        mu_sun=float(np.dot(lowest, towards)) / r,
        nu=float(np.dot(view, towards)),
        near=low - at,
        far=high - at,
        sun_irradiance=sun.irradiance,
    )


def _in_sphere(earth: EarthState, place: Array) -> Array:
    """A place where the ellipsoid is a sphere of its equatorial radius [m]."""
    radii = np.array(earth.earth.radii)
    return radii[0] / radii * (earth.R_itrf_from_icrf @ (place - earth.position))
