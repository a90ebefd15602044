"""Which edges and triangles of a spacecraft that moves during a read-out have to be drawn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from simgl.arrays import Array
from simgl.physics.frames import rotation_about
from simgl.scene.facing_triangles import facing_triangles
from simgl.scene.state import BodyState, CameraState
from simgl.view.row_clock import PoseMotion, RowClock, camera_from_body, pose_motion
from tests.scenes import lambert, scene

# Of the camera: 400 px each way, 2,000 px of focal length, 40 m from a box of 4 m.
SIZE, FOCAL, RANGE = 400, 2000.0, 40.0
Placed = tuple[CameraState, BodyState]
Motion = Callable[[Placed, float], Placed]


def slew(placed: Placed, time: float) -> Placed:
    """By 2 deg about the columns."""
    return _turned(placed, (0.0, 1.0, 0.0), np.radians(1.0) * time)


def roll(placed: Placed, time: float) -> Placed:
    """By 10 deg about the boresight."""
    return _turned(placed, (0.0, 0.0, 1.0), np.radians(5.0) * time)


def turn(placed: Placed, time: float) -> Placed:
    """The body by 10 deg: a side face comes into view, which is seen from 3 deg on."""
    camera, body = placed
    R = rotation_about(np.array([0.9, 0.0, 0.4]) / np.sqrt(0.97), np.radians(5.0) * time)
    pose = replace(body.pose, R_icrf_from_body=R @ body.pose.R_icrf_from_body)
    return camera, replace(body, pose=pose)


def thrust(placed: Placed, time: float) -> Placed:
    """The body 10 px along the rows and as much more at both ends."""
    camera, body = placed
    way = (5.0 * time + 10.0 * time**2) * RANGE / FOCAL * camera.R_camera_from_icrf[0]
    return camera, replace(body, pose=replace(body.pose, position=body.pose.position + way))


def _turned(placed: Placed, axis: tuple[float, float, float], angle: float) -> Placed:
    camera, body = placed
    R = rotation_about(np.array(axis), angle)
    return replace(camera, R_camera_from_icrf=R @ camera.R_camera_from_icrf), body


def moving(motion: Motion) -> tuple[Placed, PoseMotion]:
    camera = {
        "position_icrf_m": [0, 0, RANGE],
        "look_at": "craft",
        "up": [0.0, 1.0, 0.0],
        "width_px": SIZE,
        "height_px": SIZE,
        "focal_length_px": FOCAL,
    }
    model = {"box": {"size_m": [4.0, 4.0, 4.0], "material": lambert(0.5)}}
    one = scene({"craft": {"model": model, "position_icrf_m": [0, 0, 0]}}, camera)
    state = one.at(one.epoch_tai_ns)
    placed = state.cameras["cam"], state.bodies["craft"]
    seen = [motion(placed, time) for time in (-1.0, 0.0, 1.0)]
    return placed, pose_motion(RowClock(0, SIZE), placed[0].camera, None, seen)


def sags(motion: PoseMotion, length: float) -> Array:
    """(n,) of random edges on and in the box, how far their middles' images are off the line
    through the images of their ends [px]."""
    rng = np.random.default_rng(5)
    middles = rng.uniform(-2.0, 2.0, (4000, 3))
    way = rng.normal(size=(4000, 3))
    way *= 0.5 * length / np.linalg.norm(way, axis=1, keepdims=True)
    a, b, c = (
        FOCAL * p[:, :2] / p[:, 2:]
        for p in (motion.moved(middles + side * way) for side in (-1.0, 0.0, 1.0))
    )
    along, off = c - a, b - a
    area = along[:, 0] * off[:, 1] - along[:, 1] * off[:, 0]
    return np.asarray(np.abs(area) / np.linalg.norm(along, axis=1))


@pytest.mark.parametrize("motion", [slew, roll, turn, thrust])
def test_edges_are_cut_as_far_as_they_bend(motion: Motion) -> None:
    """By 0.02 px, and not in ten times as many parts: half of that length bends by a quarter."""
    _, moved = moving(motion)
    worst = sags(moved, moved.bend).max()
    # Directions are tried every 35 to 55 deg: up to 27 deg beside the worst, a fifth less.
    assert worst < 0.02 * 1.25
    assert worst > 0.02 / 4.0


@pytest.mark.parametrize("motion", [slew, roll, turn, thrust])
def test_no_triangle_is_left_out_that_the_camera_sees_at_any_time(motion: Motion) -> None:
    placed, moved = moving(motion)
    posed = placed[1].model.posed_mesh
    numbers = facing_triangles(posed, *moved.camera_in_body)
    corners = posed.mesh.positions[posed.mesh.triangles].astype(np.float64)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    seen = set[int]()
    for time in np.linspace(-1.0, 1.0, 41):
        inverse = np.linalg.inv(camera_from_body(*motion(placed, float(time))))
        towards = np.einsum("ni,ni->n", normals, inverse[:3, 3] - corners[:, 0])
        seen |= set(np.flatnonzero(towards > 0.0).tolist())
    assert seen <= set(numbers.tolist())
    # The far side of a box is never seen.
    assert numbers.size <= len(posed.mesh.triangles) - 2
