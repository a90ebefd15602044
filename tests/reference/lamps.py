"""Irradiance of a lamp in numpy, its light from all over the aperture."""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array
from simgl.physics.frames import camera_from_directions
from simgl.scene.lamps import LampState, beam_profile

# Rings of equal area, places around each: 1e-3 of the light from one radius on.
_RINGS, _AROUND = 8, 24


def lamp_irradiance(lamp: LampState, points: Array, normals: Array) -> Array:
    """(n, 4) irradiance of a lamp on surface elements, without occlusion [W m-2].

    The beam ends as that of a point in the middle of the aperture.

    points : (n, 3) [m], in the axes of ``lamp``
    normals : (n, 3) unit; an element gets nothing of what it faces away from
    """
    up = np.eye(3)[int(np.argmin(np.abs(lamp.direction)))]
    across = camera_from_directions(lamp.direction, up)[:2]
    radius = lamp.lamp.radius * np.sqrt((np.arange(_RINGS) + 0.5) / _RINGS)
    turn = 2.0 * np.pi * np.arange(_AROUND) / _AROUND
    ways = np.stack([np.cos(turn), np.sin(turn)], axis=1) @ across
    places = lamp.position + (radius[:, None, None] * ways).reshape(-1, 3)
    arriving = np.mean([_arriving(place, points, normals) for place in places], axis=0)
    return (_profile(lamp, points) * arriving)[:, None] * lamp.lamp.intensity


def point_irradiance(lamp: LampState, points: Array, normals: Array) -> Array:
    """The same of a lamp whose aperture has no size."""
    arriving = _arriving(lamp.position, points, normals)
    return (_profile(lamp, points) * arriving)[:, None] * lamp.lamp.intensity


def _arriving(place: Array, points: Array, normals: Array) -> Array:
    """(n,) irradiance by a point of unit intensity [m-2]."""
    beam = points - place
    facing = np.maximum(-np.sum(beam * normals, axis=1), 0.0)
    return np.asarray(facing / np.linalg.norm(beam, axis=1) ** 3)


def _profile(lamp: LampState, points: Array) -> Array:
    """(n,) intensity over that within the cone."""
    beam = points - lamp.position
    along = beam @ lamp.direction
    across = np.linalg.norm(np.cross(beam, lamp.direction), axis=1)
    return beam_profile(np.arctan2(across, along), lamp.lamp.half_angle, lamp.lamp.edge)
