"""Camera mounts: on a spacecraft, at a fixed position, or relative to a target."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from simgl.arrays import Array
from simgl.errors import ConfigError
from simgl.motion.pointing import (
    Ellipsoid,
    Limb,
    Place,
    Pointing,
    away_from_sun,
    limb_direction,
)
from simgl.motion.trajectory import lvlh_axes
from simgl.physics.frames import Pose, camera_from_directions


@dataclass(frozen=True, kw_only=True, eq=False)
class BodyMount:
    """A camera on a spacecraft, fixed to the body or rotating by its pointing law.

    position_body : (3,) of the pinhole, body axes, as stored [m]
    group : index in ``body_from_stored`` of what carries it; 0 for no joint. A joint also turns
        directions in body axes
    """

    spacecraft: str
    position_body: Array
    pointing: Pointing
    group: int = 0

    @cached_property
    def fixed(self) -> Array | None:
        """R_camera_from_body of a camera with a body-fixed direction; None for others."""
        law = self.pointing
        if law.axes != "body" or not isinstance(law.towards, np.ndarray):
            return None
        return camera_from_directions(law.towards, law.up)


@dataclass(frozen=True, kw_only=True, eq=False)
class FreeMount:
    """A camera at rest in GCRF.

    position : (3,) of the pinhole in GCRF [m]
    """

    position: Array
    pointing: Pointing


@dataclass(frozen=True, kw_only=True)
class OrbitingMount:
    """A camera that looks at a spacecraft from a given azimuth, elevation and range.

    In the target's LVLH axes, azimuth 0 is behind the target (-x) and azimuth 90 deg above it
    (zenith, -z); elevation is positive towards the orbit normal (-y). Angles [rad], range [m] from
    the target's body origin. The top of the image points along increasing azimuth: to zenith at
    azimuth 0.
    """

    target: str
    azimuth: float
    elevation: float
    range: float


Mount = BodyMount | FreeMount | OrbitingMount


# Spacecraft to (joints + 1, 4, 4) of ``body_from_stored``; None where all joints are as stored.
Motions = Mapping[str, Array | None]


def motion_of(spacecraft: str, group: int, motions: Motions) -> Array | None:
    """(4, 4) from stored to current positions, body axes; None for what no joint moves."""
    motion = motions.get(spacecraft) if group else None
    return None if motion is None else motion[group]


def at_joints(mount: Mount, motions: Motions) -> Mount:
    """The mount with the joints of spacecraft moved: what they carry is where they bring it."""
    if isinstance(mount, OrbitingMount):
        return mount
    law = mount.pointing
    if isinstance(law.towards, Place):
        place = law.towards
        moved = motion_of(place.spacecraft, place.group, motions)
        if moved is not None:
            position = moved[:3, :3] @ place.position_body + moved[:3, 3]
            law = replace(law, towards=replace(place, position_body=position, group=0))
            mount = replace(mount, pointing=law)
    if isinstance(mount, FreeMount):
        return mount
    moved = motion_of(mount.spacecraft, mount.group, motions)
    if moved is None:
        return mount
    turn = moved[:3, :3]
    if law.axes == "body":
        towards = turn @ law.towards if isinstance(law.towards, np.ndarray) else law.towards
        law = replace(law, towards=towards, up=turn @ law.up)
    position = turn @ mount.position_body + moved[:3, 3]
    return replace(mount, position_body=position, pointing=law, group=0)


def camera_velocity(mount: Mount, bodies: Mapping[str, Pose]) -> Array:
    """(3,) velocity of a camera in GCRF [m s-1]: that of its spacecraft or target, else 0."""
    if isinstance(mount, FreeMount):
        return np.zeros(3)
    return bodies[mount.target if isinstance(mount, OrbitingMount) else mount.spacecraft].velocity


def at_rest(mount: BodyMount) -> Array:
    """R_camera_from_body of a camera on its spacecraft.

    Cameras that rotate are given as looking along body x, with body -z at the top of the image.
    """
    if mount.fixed is not None:
        return mount.fixed
    return camera_from_directions([1.0, 0.0, 0.0], [0.0, 0.0, -1.0])


def camera_pose(
    name: str,
    mount: Mount,
    bodies: Mapping[str, Pose],
    sun_direction: Callable[[Array], Array] | None = None,
    earth: Ellipsoid | None = None,
) -> tuple[Array, Array]:
    """Position (3,) [m] and R_camera_from_icrf of the camera ``name`` on its mount.

    bodies : pose of each spacecraft
    sun_direction : (3,) unit, towards the Sun from a position; needed for a Sun exclusion angle
    earth : needed for pointing at the limb

    Raises ConfigError if the mount defines no direction, such as towards a target at the pinhole.
    """
    where = f"[camera.{name}]"
    if isinstance(mount, OrbitingMount):
        return _about(where, mount, bodies)
    law = mount.pointing
    if isinstance(mount, FreeMount):
        position, R_icrf_from_axes = mount.position, np.eye(3)
    else:
        body = bodies[mount.spacecraft]
        position = body.position + body.R_icrf_from_body @ mount.position_body
        if mount.fixed is not None and law.sun_exclusion == 0.0:
            return position, mount.fixed @ body.R_icrf_from_body.T
        R_icrf_from_axes = _axes(where, mount, body)
    up = R_icrf_from_axes @ law.up
    if isinstance(law.towards, Place):
        boresight = _towards(where, law.towards, position, bodies)
    elif isinstance(law.towards, Limb):
        assert isinstance(mount, BodyMount)
        assert earth is not None
        R_lvlh_from_icrf = _lvlh(where, "limb", mount.spacecraft, bodies)
        try:
            boresight = limb_direction(law.towards, position, R_lvlh_from_icrf, earth)
        except ValueError as error:
            raise ConfigError(where, "limb.tangent_height_km", str(error)) from None
    else:
        boresight = R_icrf_from_axes @ law.towards
    if law.sun_exclusion > 0.0:
        assert sun_direction is not None
        boresight = away_from_sun(boresight, sun_direction(position), law.sun_exclusion, up)
    return position, camera_from_directions(boresight, up)


def _lvlh(where: str, key: str, name: str, bodies: Mapping[str, Pose]) -> Array:
    body = bodies[name]
    return lvlh_axes(where, key, name, body.position, body.velocity)


def _about(where: str, mount: OrbitingMount, bodies: Mapping[str, Pose]) -> tuple[Array, Array]:
    R_icrf_from_lvlh = _lvlh(where, "about", mount.target, bodies).T
    ca, sa = np.cos(mount.azimuth), np.sin(mount.azimuth)
    ce, se = np.cos(mount.elevation), np.sin(mount.elevation)
    out = R_icrf_from_lvlh @ np.array([-ca * ce, -se, -sa * ce])
    up = R_icrf_from_lvlh @ np.array([sa, 0.0, -ca])
    position = bodies[mount.target].position + mount.range * out
    return position, camera_from_directions(-out, up)


def _axes(where: str, mount: BodyMount, body: Pose) -> Array:
    """R_icrf_from_axes of a pointing law's directions."""
    if mount.pointing.axes == "icrf":
        return np.eye(3)
    if mount.pointing.axes == "body":
        return body.R_icrf_from_body
    return _lvlh(where, "axes", mount.spacecraft, {mount.spacecraft: body}).T


def _towards(where: str, place: Place, position: Array, bodies: Mapping[str, Pose]) -> Array:
    body = bodies[place.spacecraft]
    line = body.position + body.R_icrf_from_body @ place.position_body - position
    if not np.any(line):
        what = "whose place there" if np.any(place.position_body) else "whose origin"
        problem = f'cannot look at "{place.spacecraft}", {what} is at the pinhole'
        raise ConfigError(where, "look_at", problem)
    return line
