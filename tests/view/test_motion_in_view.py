"""How far what is in view moves, for shapes whose motion in the image is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simgl.physics.frames import rotation_about
from simgl.scene.state import SceneState
from simgl.view.motion_in_view import parts_in_view
from tests.scenes import Table, lambert, scene

# Of the camera: 40 px across, 400 px of focal length, 100 m from the craft.
FOCAL, WIDTH, RANGE = 400.0, 40, 100.0
PIXEL = RANGE / FOCAL
STEP = 0.5


def states(model: Table, start_px: float, way_px: float) -> tuple[SceneState, SceneState]:
    """Of a craft to the right of the boresight by pixels, and so many more."""
    camera = {
        "position_icrf_m": [0, 0, RANGE],
        "look_at": "craft",
        "up": [0.0, 1.0, 0.0],
        "width_px": WIDTH,
        "height_px": WIDTH,
        "focal_length_px": FOCAL,
    }
    one = scene({"craft": {"model": model, "position_icrf_m": [0, 0, 0]}}, camera)
    rest = one.at(one.epoch_tai_ns)
    body, right = rest.bodies["craft"], rest.cameras["cam"].R_camera_from_icrf[0]

    def at(px: float) -> SceneState:
        pose = replace(body.pose, position=px * PIXEL * right)
        return replace(rest, bodies={"craft": replace(body, pose=pose)})

    return at(start_px), at(start_px + way_px)


def box(width_px: float, height_px: float) -> Table:
    size = [width_px * PIXEL, height_px * PIXEL, 0.01]
    return {"box": {"size_m": size, "material": lambert(0.5)}}


@pytest.mark.parametrize(
    ("width_px", "height_px"),
    [
        (5.0, 5.0),  # all of it in view
        (5.0, 4000.0),  # edges whose ends are far out
        (4000.0, 4000.0),  # no edge is in view but diagonals
        (0.1, 4000.0),  # thin
    ],
)
def test_what_is_in_view_counts_by_its_way_in_pixels(width_px: float, height_px: float) -> None:
    first, second = states(box(width_px, height_px), 0.0, 3.0)
    # Off the axis, by 20 px of 400 and in the corners, a pixel is seen under less.
    assert parts_in_view(first, second, "cam", STEP) == pytest.approx(3.0 / STEP, rel=0.01)


def test_what_is_out_of_view_may_go_as_far_as_it_is_away() -> None:
    """300 px from the axis, 272 px from the circle around the view."""
    first, second = states(box(5.0, 5.0), 300.0, -100.0)
    assert parts_in_view(first, second, "cam", STEP) < 1.0


def test_what_crosses_the_view_between_two_states_is_not_missed() -> None:
    first, second = states(box(5.0, 5.0), -300.0, 600.0)
    assert parts_in_view(first, second, "cam", STEP) > 2.0


def test_a_turn_before_a_camera_close_by_counts_as_what_it_sees() -> None:
    """1 m before a wall of 200 m, whose far ends go by 100 times as much."""
    first, _ = states(box(800.0, 800.0), 0.0, 0.0)
    camera, body = first.cameras["cam"], first.bodies["craft"]
    near = replace(camera, position=camera.position * 0.01)
    turned = rotation_about(camera.R_camera_from_icrf[2], 0.01) @ body.pose.R_icrf_from_body
    pose = replace(body.pose, R_icrf_from_body=turned)
    first = replace(first, cameras={"cam": near})
    second = replace(first, bodies={"craft": replace(body, pose=pose)})
    # About the boresight: in the corners, 28 px out.
    corner = np.hypot(20.0, 20.0)
    assert parts_in_view(first, second, "cam", STEP) == pytest.approx(
        0.01 * corner / STEP, rel=0.02
    )
