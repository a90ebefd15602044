"""How spacecraft and what is behind them go across the image as a camera turns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simgl.physics.frames import rotation_about
from simgl.scene.state import SceneState
from simgl.view.exposure_parts import MovingScene, moving_scene
from simgl.view.image_motion import background_motion
from simgl.view.image_paths import background_paths, spacecraft_paths
from tests.scenes import lambert, scene

WIDTH, HEIGHT, FOCAL, RANGE, EXPOSURE = 320, 240, 1500.0, 40.0, 0.01
SLEW, ROLL = (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def turned(state: SceneState, axis: tuple[float, float, float], angle: float) -> SceneState:
    camera = state.cameras["cam"]
    R = rotation_about(np.array(axis), angle) @ camera.R_camera_from_icrf
    return replace(state, cameras={"cam": replace(camera, R_camera_from_icrf=R)})


def rest() -> SceneState:
    camera = {
        "position_icrf_m": [0, 0, RANGE],
        "look_at": "craft",
        "up": [0.0, 1.0, 0.0],
        "width_px": WIDTH,
        "height_px": HEIGHT,
        "focal_length_px": FOCAL,
        "exposure_time_s": EXPOSURE,
        "shutter": "global",
    }
    model = {"box": {"size_m": [2.0, 2.0, 2.0], "material": lambert(0.5)}}
    one = scene({"craft": {"model": model, "position_icrf_m": [0, 0, 0]}}, camera)
    return one.at(one.epoch_tai_ns)


def during(axis: tuple[float, float, float], angle_deg: float) -> MovingScene:
    state = rest()

    def at(tai_ns: int) -> SceneState:
        share = (tai_ns - state.tai_ns) * 1e-9 / EXPOSURE
        return turned(state, axis, np.radians(angle_deg) * share)

    moving = moving_scene(state, "cam", at)
    assert moving is not None
    return moving


@pytest.mark.parametrize(("axis", "angle_deg"), [(SLEW, 2.0), (ROLL, 10.0), ((0.5, 0.3, 0.8), 3.0)])
def test_spacecraft_go_as_the_stars_do_where_the_camera_turns(
    axis: tuple[float, float, float], angle_deg: float
) -> None:
    """A box that covers an eighth of the image, whose ways go on beyond it."""
    moving = during(axis, angle_deg)
    d = moving.drawn.detector
    (part,), behind = next(moving.snapshots()), next(moving.behind())
    craft = spacecraft_paths([part], ["craft"], (0, 0, d.width, d.height))
    # float32 ways of 50 px.
    assert craft.differ(background_paths(behind, "cam")) < 1e-5


def test_a_roll_moves_what_is_behind_by_what_the_corners_go() -> None:
    """A chord of a circle through them, and not the focal length times the angle, 262 px."""
    state = rest()
    moved = background_motion(state, turned(state, ROLL, np.radians(10.0)), "cam")
    corner = 0.5 * np.hypot(WIDTH, HEIGHT)
    assert moved == pytest.approx(2.0 * corner * np.sin(np.radians(5.0)), rel=1e-6)


@pytest.mark.parametrize(("angle_deg", "count"), [(10.0, 1), (60.0, 4)])
def test_arcs_of_what_is_behind_are_drawn_in_parts_that_are_parabolas(
    angle_deg: float, count: int
) -> None:
    """0.05 px: a corner 200 px out has a third derivative of 200 px times the cube of the angle."""
    assert during(ROLL, angle_deg).behind_count == count
