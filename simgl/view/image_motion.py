"""How far a camera's image moves between two states."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from simgl.arrays import Array
from simgl.camera.rolling_shutter import duration, instants, parts
from simgl.motion.joints import body_from_stored
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.state import BodyState, CameraState, SceneState


def image_motion(first: SceneState, second: SceneState, camera: str) -> float:
    """Upper bound on how far anything in view moves across the image [px].

    Bodies that are not in view count too; the ground only where the Earth may be in view.
    """
    a, b = first.cameras[camera], second.cameras[camera]
    turned = _angle(b.R_camera_from_icrf @ a.R_camera_from_icrf.T)
    moved = [turned]
    moved += [_body_motion(a, b, first.bodies[n], second.bodies[n]) for n in first.bodies]
    if first.earth is not None:
        moved.append(turned + _ground_motion(first, a, b))
    return a.camera.focal_length_px * max(moved)


def _angle(rotation: Array) -> float:
    """Of a rotation [rad], good for small ones."""
    sine = 0.5 * np.linalg.norm(
        [
            rotation[2, 1] - rotation[1, 2],
            rotation[0, 2] - rotation[2, 0],
            rotation[1, 0] - rotation[0, 1],
        ]
    )
    return float(np.arctan2(sine, 0.5 * (np.trace(rotation) - 1.0)))


def _body_motion(a: CameraState, b: CameraState, before: BodyState, after: BodyState) -> float:
    """Of a body's fastest point across the line of sight [rad]."""
    place_a = a.R_camera_from_icrf @ (before.pose.position - a.position)
    place_b = b.R_camera_from_icrf @ (after.pose.position - b.position)
    R_a = a.R_camera_from_icrf @ before.pose.R_icrf_from_body
    R_b = b.R_camera_from_icrf @ after.pose.R_icrf_from_body
    mesh = before.model.posed_mesh
    reach = float(np.linalg.norm(mesh.centre)) + mesh.radius
    travel = float(np.linalg.norm(place_b - place_a)) + _angle(R_b @ R_a.T) * reach
    travel += _joint_motion(before.model, after.model)
    # From inside a body's sphere, a tenth of it stands for how near its surface may be.
    nearest = max(float(np.linalg.norm(place_a)) - reach, 0.1 * reach)
    return travel / nearest


def _joint_motion(before: SpacecraftModel, after: SpacecraftModel) -> float:
    """How far joints move anything in body axes, at most [m]."""
    if before is after or not before.joints:
        return 0.0
    rest = (0.0,) * len(before.joints)
    first, second = (body_from_stored(m.joints, m.angles or rest) for m in (before, after))
    spheres = before.mesh.part_spheres
    moved = [0.0]
    for joint, a, b in zip(before.joints, first[1:], second[1:], strict=True):
        for middle, radius in ((spheres[p, :3], spheres[p, 3]) for p in joint.parts):
            shift = (b - a)[:3, :3] @ middle + (b - a)[:3, 3]
            turn = _angle(b[:3, :3] @ a[:3, :3].T)
            moved.append(float(np.linalg.norm(shift)) + turn * float(radius))
    return max(moved)


def _ground_motion(state: SceneState, a: CameraState, b: CameraState) -> float:
    """Of the ground below a moving camera [rad]; 0 where the whole Earth is out of view."""
    assert state.earth is not None
    radius = max(state.earth.earth.radii)
    down = state.earth.position - a.position
    distance = float(np.linalg.norm(down))
    height = max(distance - radius, 1.0)
    disc = np.arcsin(min(radius / distance, 1.0))
    off_axis = np.arccos(np.clip(a.R_camera_from_icrf[2] @ down / distance, -1.0, 1.0))
    if off_axis > disc + a.camera.half_diagonal_angle:
        return 0.0
    return float(np.linalg.norm(b.position - a.position)) / height


def states_over_exposure(
    state: SceneState, name: str, during: Callable[[int], SceneState]
) -> list[SceneState]:
    """The scene at instants over a camera's exposure; empty where nothing moves visibly.

    during : the scene at other epochs [TAI ns]
    """
    camera = state.cameras[name].camera

    def at(offset: float) -> SceneState:
        moved = during(state.tai_ns + round(offset * 1e9))
        # The exposure time may have been chosen for this image alone.
        placed = replace(moved.cameras[name], camera=camera)
        return replace(moved, cameras={**moved.cameras, name: placed})

    half = 0.5 * duration(camera)
    # On either side of the middle: a motion that turns back shows none from end to end.
    motion = sum(image_motion(state, at(offset), name) for offset in (-half, half))
    count = parts(camera, motion)
    return [at(offset) for offset in instants(camera, count).tolist()] if count else []
