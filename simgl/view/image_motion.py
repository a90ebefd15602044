"""How far a camera's image moves between two states."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from simgl.arrays import Array
from simgl.motion.joints import body_from_stored, relative_motion
from simgl.physics.frames import angle_between
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.state import BodyState, CameraState, SceneState

# How far what hides something else moves against it in one snapshot [px].
LARGEST_STEP = 1.0


def spacecraft_motion(first: SceneState, second: SceneState, camera: str) -> float:
    """Upper bound on how far anything of a spacecraft moves across the image [px].

    Bodies that are not in view count too.
    """
    a, b = first.cameras[camera], second.cameras[camera]
    moved = [_body_motion(a, b, first.bodies[n], second.bodies[n]) for n in first.bodies]
    return a.camera.focal_length_px * max(moved, default=0.0)


def background_motion(first: SceneState, second: SceneState, camera: str) -> float:
    """The same of what is behind them; the ground counts only where the Earth may be in view."""
    a, b = first.cameras[camera], second.cameras[camera]
    moved = _sky_motion(a, b)
    if first.earth is not None:
        moved += a.camera.focal_length_px * _ground_motion(first, a, b)
    return moved


def _sky_motion(a: CameraState, b: CameraState) -> float:
    """Of the stars [px].

    In the image of a pinhole a turn moves them nearly as a linear map does: those in the corners
    go farthest.
    """
    R, camera = b.R_camera_from_icrf @ a.R_camera_from_icrf.T, a.camera
    if camera.is_pinhole:
        size = camera.detector.width, camera.detector.height
        corners = np.array(list(product(*((0.0, one) for one in size))))
        ways = [camera.project(camera.rays(corners) @ turn) - corners for turn in (R.T, R)]
        longest = float(np.linalg.norm(ways, axis=-1).max())
        if np.isfinite(longest):
            return longest
    return camera.focal_length_px * _angle(R)


def turn_of_camera(first: SceneState, second: SceneState, camera: str) -> float:
    """Angle by which it turns against the stars [rad]."""
    a, b = first.cameras[camera], second.cameras[camera]
    return _angle(b.R_camera_from_icrf @ a.R_camera_from_icrf.T)


def turn_of_bodies(first: SceneState, second: SceneState) -> float:
    """Largest angle by which a body turns against the stars [rad]."""
    return max(
        (turn_of_body(one, second.bodies[n]) for n, one in first.bodies.items()), default=0.0
    )


def turn_of_body(before: BodyState, after: BodyState) -> float:
    """Angle by which it turns against the stars [rad]."""
    return _angle(after.pose.R_icrf_from_body @ before.pose.R_icrf_from_body.T)


def turn_of_joints(first: SceneState, second: SceneState) -> float:
    """Largest angle by which a joint turns its parts against their body [rad]."""
    turned = [0.0]
    for name, before in first.bodies.items():
        turned += [_angle(m[:3, :3]) for m in joints_moved(before.model, second.bodies[name].model)]
    return max(turned)


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
    return travel / _nearest(a, before)


def joints_moved(before: SpacecraftModel, after: SpacecraftModel) -> Array:
    """(n, 4, 4) how each rigid group of a model moves from one pose to another, body axes.

    Of none where no joint moves.
    """
    first, second = before.posed_mesh.motion, after.posed_mesh.motion
    if before is after or not before.joints or (first is None and second is None):
        return np.zeros((0, 4, 4))
    rest = np.tile(np.eye(4), (len(before.joints) + 1, 1, 1))
    return relative_motion(rest if first is None else first, rest if second is None else second)


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
            turned = _angle(b[:3, :3] @ a[:3, :3].T)
            moved.append(float(np.linalg.norm(shift)) + turned * float(radius))
    return max(moved)


def _sphere(body: BodyState) -> tuple[Array, float]:
    """Centre (3,) and radius of the bounding sphere of a body, ICRF axes [m]."""
    mesh = body.model.posed_mesh
    return body.pose.position + body.pose.R_icrf_from_body @ mesh.centre, mesh.radius


def shades(state: SceneState, name: str, other: str) -> bool:
    """Whether a spacecraft may shade another one, by their bounding spheres."""
    (place, reach), (middle, radius) = (_sphere(state.bodies[each]) for each in (name, other))
    light = state.direct_light(state.bodies[other].pose.position).main
    separation = place - middle
    along = float(separation @ light.direction_icrf)
    across = float(np.linalg.norm(separation - along * light.direction_icrf))
    beyond = max(along, 0.0) * float(np.tan(light.angular_radius))
    return along > -radius - reach and across < radius + reach + beyond


@dataclass(frozen=True, kw_only=True)
class Pair:
    """Two spacecraft before a camera, from the start of an exposure to its end.

    ways : of each across the image, at most [px]
    against : of one against the other, at most [px]
    may_overlap : whether they may come before each other
    """

    ways: tuple[float, float]
    against: float
    may_overlap: bool

    @classmethod
    def of(cls, states: Sequence[SceneState], camera: str, name: str, other: str) -> Pair:
        """states : at even times; on either side of the middle, for what turns back goes nowhere"""
        middle = states[len(states) // 2]
        a, before, neighbour = middle.cameras[camera], middle.bodies[name], middle.bodies[other]
        gap, mesh = _gap_angle(a, before, neighbour), neighbour.model.posed_mesh
        ways, against, overlap = np.zeros(2), 0.0, False
        for end in (states[0], states[-1]):
            b, after, moved_to = end.cameras[camera], end.bodies[name], end.bodies[other]
            both = _body_motion(a, b, before, after), _body_motion(a, b, neighbour, moved_to)
            overlap = overlap or gap < sum(both)
            change = _in_other(after, moved_to) - _in_other(before, neighbour)
            way = float(np.linalg.norm(change[:3, :3] @ mesh.centre + change[:3, 3]))
            way += float(np.linalg.norm(change[:3, :3], 2)) * mesh.radius
            ways += both
            against += way / _nearest(a, neighbour)
        focal = a.camera.focal_length_px
        one, two = (focal * ways).tolist()
        return cls(ways=(one, two), against=focal * against, may_overlap=overlap)


def joints_against_bodies(states: Sequence[SceneState], camera: str, names: Iterable[str]) -> float:
    """How far joints carry parts of spacecraft against the rest of these, at most [px]."""
    middle = states[len(states) // 2]
    a = middle.cameras[camera]
    largest = 0.0
    for name in names:
        before = middle.bodies[name]
        moved = sum(
            _joint_motion(before.model, end.bodies[name].model) for end in (states[0], states[-1])
        )
        largest = max(largest, moved / _nearest(a, before))
    return a.camera.focal_length_px * largest


def _in_other(body: BodyState, other: BodyState) -> Array:
    """(4, 4) from the axes of another body to those of a body [m]."""
    matrix = np.eye(4)
    matrix[:3, :3] = body.pose.R_icrf_from_body.T @ other.pose.R_icrf_from_body
    matrix[:3, 3] = body.in_body(other.pose.position)
    return matrix


def _nearest(camera: CameraState, body: BodyState) -> float:
    """Distance of a body's bounding sphere, at least [m]; a tenth of its reach within that."""
    mesh = body.model.posed_mesh
    reach = float(np.linalg.norm(mesh.centre)) + mesh.radius
    distance = float(np.linalg.norm(body.pose.position - camera.position))
    return max(distance - reach, 0.1 * reach)


def _gap_angle(camera: CameraState, *bodies: BodyState) -> float:
    """Between the bounding spheres of two bodies as the camera sees them [rad]; less than 0 where
    they overlap."""
    sights, widths = [], 0.0
    for body in bodies:
        mesh = body.model.posed_mesh
        sights.append(body.pose.position + body.pose.R_icrf_from_body @ mesh.centre)
        sights[-1] -= camera.position
        widths += float(np.arcsin(min(mesh.radius / float(np.linalg.norm(sights[-1])), 1.0)))
    return angle_between(*sights) - widths


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


def ways_behind(ends: tuple[SceneState, SceneState], name: str) -> Array:
    """(2,) how far along x and y what is at infinity moves in the corners of the image [px]."""
    first, last = (end.cameras[name] for end in ends)
    d = first.camera.detector
    corners = np.array([[x, y] for x in (0.0, d.width) for y in (0.0, d.height)])
    sights = first.camera.rays(corners) @ first.R_camera_from_icrf @ last.R_camera_from_icrf.T
    return np.nan_to_num(np.abs(last.camera.project(sights) - corners), nan=np.inf).max(axis=0)
