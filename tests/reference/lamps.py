"""Irradiance of a lamp in numpy: what ``shaders/surface/lamp.glsl`` computes."""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array
from simgl.scene.lamps import LampState, beam_profile


def lamp_irradiance(lamp: LampState, points: Array, normals: Array) -> Array:
    """(n, 4) irradiance of a lamp on surface elements, without occlusion [W m-2].

    points : (n, 3) [m], in the axes of ``lamp``
    normals : (n, 3) unit; an element that faces away gets nothing

    The lamp is a point source; closer than ``radius`` the inverse-square law is capped.
    """
    beam = points - lamp.position
    distance = np.linalg.norm(beam, axis=1)
    along = beam @ lamp.direction
    across = np.linalg.norm(np.cross(beam, lamp.direction), axis=1)
    profile = beam_profile(np.arctan2(across, along), lamp.lamp.half_angle, lamp.lamp.edge)
    cosine = -np.sum(beam * normals, axis=1) / np.maximum(distance, 1e-12)
    reached = profile * np.maximum(cosine, 0.0) / np.maximum(distance, lamp.lamp.radius) ** 2
    return reached[:, None] * lamp.lamp.intensity
