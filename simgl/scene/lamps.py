"""Spot lights: a beam of given power, and its irradiance on a surface."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from simgl.arrays import Array
from simgl.errors import ConfigError
from simgl.physics.frames import Pose, unit
from simgl.physics.spectrum import LineSpectrum


@dataclass(frozen=True, kw_only=True, eq=False)
class Lamp:
    """A spot light on a spacecraft.

    spacecraft : name of the one that carries it
    position_body : (3,) of the middle of its aperture, as stored [m]
    boresight_body : (3,) unit, of the beam's axis, in body axes, as stored
    group : index in ``body_from_stored`` of what carries it; 0 for no joint
    look_at : name of the spacecraft that the beam follows; None keeps the boresight
    power : (4,) optical, radiated in each band over the whole beam [W]
    half_angle : of the cone within which the intensity is uniform [rad]
    edge : width of the smooth fall to zero around it [rad]
    radius : of the aperture [m]
    spectrum : within the bands; None for that of sunlight
    """

    name: str
    spacecraft: str
    position_body: Array
    boresight_body: Array
    look_at: str | None
    power: Array
    half_angle: float
    edge: float
    radius: float
    spectrum: LineSpectrum | None = None
    group: int = 0

    @property
    def intensity(self) -> Array:
        """(4,) radiant intensity within the cone [W sr-1]."""
        return self.power / beam_solid_angle(self.half_angle, self.edge)


@dataclass(frozen=True, kw_only=True, eq=False)
class LampState:
    """A lamp at an instant, in ICRF axes or, after ``seen_from_body``, in those of a body.

    position : (3,) [m]
    direction : (3,) unit, of the beam
    """

    lamp: Lamp
    position: Array
    direction: Array

    def seen_from_body(self, pose: Pose) -> LampState:
        """The same lamp in a body's axes, from its origin."""
        R_body_from_icrf = pose.R_icrf_from_body.T
        return replace(
            self,
            position=R_body_from_icrf @ (self.position - pose.position),
            direction=R_body_from_icrf @ self.direction,
        )


def lamp_state(
    lamp: Lamp, bodies: Mapping[str, Pose], body_from_stored: Array | None = None
) -> LampState:
    """Position and beam direction of a lamp, in ICRF axes.

    body_from_stored : (4, 4) of the joint that carries it; None where it is as stored

    Raises ConfigError where the spacecraft that it follows is at its own place.
    """
    body = bodies[lamp.spacecraft]
    moved = np.eye(4) if body_from_stored is None else body_from_stored
    position_body = moved[:3, :3] @ lamp.position_body + moved[:3, 3]
    position = body.position + body.R_icrf_from_body @ position_body
    if lamp.look_at is None:
        direction = body.R_icrf_from_body @ (moved[:3, :3] @ lamp.boresight_body)
    else:
        direction = bodies[lamp.look_at].position - position
        if not np.any(direction):
            problem = f'cannot look at "{lamp.look_at}", whose origin is at the lamp'
            raise ConfigError(f"[lamp.{lamp.name}]", "look_at", problem)
    return LampState(lamp=lamp, position=position, direction=unit(direction))


def beam_profile(angle: Array, half_angle: float, edge: float) -> Array:
    """Intensity at an angle from the axis over that within the cone, 0..1; all angles [rad].

    Half a cosine leads from 1 at ``half_angle`` to 0 at ``half_angle + edge``.
    """
    share = np.clip((np.asarray(angle) - half_angle) / edge, 0.0, 1.0)
    return 0.5 + 0.5 * np.cos(np.pi * share)


def beam_solid_angle(half_angle: float, edge: float) -> float:
    """Power of a beam over its intensity within the cone [sr].

    The integral of 2 pi sin(angle) times the profile: with k = pi / edge > 1 the fall holds
    (cos h - cos(h + e)) / 2 - (cos h + cos(h + e)) / (2 (k^2 - 1)).
    """
    inner, outer = np.cos(half_angle), np.cos(half_angle + edge)
    k2 = (np.pi / edge) ** 2
    fall = 0.5 * (inner - outer) - 0.5 * (inner + outer) / (k2 - 1.0)
    return float(2.0 * np.pi * (1.0 - inner + fall))
