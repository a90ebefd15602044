"""How a camera sees the spacecraft of a scene: from how far, and under which phase angle."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from simgl.physics.frames import angle_between
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.state import CameraState, SceneState


def reach(model: SpacecraftModel) -> float:
    """Radius of a sphere about the body's origin that holds the model [m]."""
    return float(np.linalg.norm(model.mesh.centre)) + model.mesh.radius


def sights(state: SceneState, placed: CameraState) -> Iterator[tuple[str, float, float]]:
    """Name, range [m] and phase angle [rad] of the spacecraft that the camera does not sit on."""
    for name, body in state.bodies.items():
        to_camera = placed.position - body.pose.position
        distance = float(np.linalg.norm(to_camera))
        if distance > reach(body.model):
            sun_direction = state.sun.seen_from(body.pose.position).direction_icrf
            yield name, distance, angle_between(sun_direction, to_camera)
