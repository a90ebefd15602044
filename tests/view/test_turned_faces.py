"""Faces that come into view while a body turns, for boxes whose faces are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simgl.camera.camera import Camera
from simgl.physics.frames import rotation_about
from simgl.scene.posed_mesh import PosedMesh
from simgl.view.row_clock import camera_from_body
from simgl.view.turned_faces import snapshots_of_faces
from tests.scenes import Table, lambert, scene

FOCAL, RANGE = 4000.0, 400.0
PIXEL = RANGE / FOCAL
# Of the box [px].
WIDTH, HEIGHT = 100.0, 120.0
WHITE = lambert(0.5)


def turning(
    model: Table, first_deg: float, last_deg: float
) -> tuple[PosedMesh, Camera, np.ndarray]:
    """A body about an axis upright in the image; at 0 its z axis looks to the camera."""
    camera = {
        "position_icrf_m": [0, 0, RANGE],
        "look_at": "craft",
        "up": [0.0, 1.0, 0.0],
        "width_px": 640,
        "height_px": 640,
        "focal_length_px": FOCAL,
    }
    one = scene({"craft": {"model": model, "position_icrf_m": [0, 0, 0]}}, camera)
    rest = one.at(one.epoch_tai_ns)
    body, placed = rest.bodies["craft"], rest.cameras["cam"]

    def pose(angle: float) -> np.ndarray:
        R = rotation_about(np.array([0.0, 1.0, 0.0]), angle) @ body.pose.R_icrf_from_body
        turned = replace(body, pose=replace(body.pose, R_icrf_from_body=R))
        return camera_from_body(placed, turned)

    angles = np.radians(np.linspace(first_deg, last_deg, 49))
    return body.model.posed_mesh, placed.camera, np.array([pose(one) for one in angles])


def box(depth_px: float) -> Table:
    size = [WIDTH * PIXEL, HEIGHT * PIXEL, depth_px * PIXEL]
    return {"box": {"size_m": size, "material": WHITE}}


def count(model: Table, first_deg: float, last_deg: float) -> float:
    return snapshots_of_faces(*turning(model, first_deg, last_deg), WIDTH * HEIGHT)


@pytest.mark.parametrize("depth_px", [10.0, 40.0, 160.0])
def test_snapshots_leave_a_hundredth_of_a_pixel(depth_px: float) -> None:
    """One side face goes, the other comes in the middle of a turn by 20 deg.

    Each changes its area by the depth times the height times the sine of the turn.
    """
    turn = np.radians(20.0)
    growth = np.sqrt(2.0) * depth_px * HEIGHT * turn
    left = 0.125 / np.sqrt(5.0) * growth / (2.0 * np.sqrt(WIDTH * HEIGHT))
    # As the faces' corners are nearer or farther by some percent than the middle of the box.
    assert count(box(depth_px), -10.0, 10.0) == pytest.approx(np.sqrt(left / 0.01), rel=0.05, abs=1)


def test_faces_that_stay_in_view_need_one_snapshot() -> None:
    assert count(box(40.0), 10.0, 40.0) == 1.0


def test_a_face_that_comes_at_the_end_has_no_time_to_be_wrong() -> None:
    assert count(box(40.0), -20.0, 0.2) == 1.0 < count(box(40.0), -20.0, 10.0)


def test_the_sides_of_a_cylinder_look_alike() -> None:
    """It turns about its axis, which the camera sees upright."""
    model: Table = {"cylinder": {"radius_m": 5.0, "length_m": 12.0, "material": WHITE}}
    posed, camera, poses = turning(model, -10.0, 10.0)
    # From the model's axis, z, to the upright one.
    upright = np.eye(4)
    upright[:3, :3] = rotation_about(np.array([1.0, 0.0, 0.0]), 0.5 * np.pi)
    assert snapshots_of_faces(posed, camera, poses @ upright, WIDTH * HEIGHT) == 1.0
