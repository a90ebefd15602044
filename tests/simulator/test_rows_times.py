"""Rolling shutters: what turns, what joints move, how often it is drawn, and that nothing stays."""

from __future__ import annotations

from dataclasses import replace

import moderngl
import numpy as np
import pytest

from simgl.passes.visibility import VisibilityPass
from simgl.scenario.scenario import Scenario
from simgl.simulator import Simulator
from tests.simulator.moving_scenes import (
    READ_OUT,
    Motion,
    craft,
    drifting,
    electrons,
    row_errors,
    turning,
)


@pytest.mark.parametrize(("angle_deg", "camera"), [(10.0, False), (45.0, False), (1.0, True)])
def test_each_row_sees_what_turns_at_its_own_time(
    gl: moderngl.Context, angle_deg: float, camera: bool
) -> None:
    """The edges of the box, straight in the scene, are bent: by 12 px for 45 deg over 90 rows;
    a turn of the camera by 1 deg moves the picture by 60 px."""
    one = craft()
    errors = row_errors(gl, one, turning(one, np.radians(angle_deg), camera=camera))
    # 60 samples in a pixel place either image's edges to 0.01 px.
    assert np.sqrt(np.mean(np.square(errors))) < 0.02


def test_each_row_sees_what_accelerates_at_its_own_time(gl: moderngl.Context) -> None:
    """The box comes back to where it was: its sides are parabolas, and no end of them tells so."""
    one = craft(width_px=256)
    errors = row_errors(gl, one, drifting(one, 0.0, 40.0))
    # As of what turns; 16 px where only motion from end to end bends edges.
    assert np.sqrt(np.mean(np.square(errors))) < 0.02


@pytest.mark.parametrize(
    "distortion",
    [{"k1": -0.3, "p1": 0.01}, {"model": "fisheye", "k1": 0.02}],
    ids=["barrel", "fisheye"],
)
def test_rows_that_a_lens_bends_see_what_moves_at_their_own_time(
    gl: moderngl.Context, distortion: dict[str, object]
) -> None:
    """60 px over the rows, in a field of 44 deg that the spacecraft half fills."""
    one = craft(
        position_icrf_m=[0.7, 0.7, 4.9],
        focal_length_px=160.0,
        optics={"distortion": distortion},
    )
    errors = row_errors(gl, one, drifting(one, 60.0))
    # As without distortion.
    assert np.sqrt(np.mean(np.square(errors))) < 0.02


def count_drawings(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, one: Scenario, during: Motion
) -> int:
    drawn: list[object] = []
    draw = VisibilityPass.draw

    def counted(self: VisibilityPass, *given: object) -> moderngl.Texture:
        drawn.append(given)
        return draw(self, *given)  # type: ignore[arg-type]

    monkeypatch.setattr(VisibilityPass, "draw", counted)
    with Simulator(one, gl) as simulator:
        electrons(simulator, during(one.epoch_tai_ns), during)
    return len(drawn)


def test_what_moves_across_the_rows_is_drawn_once(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = craft(5)
    assert count_drawings(gl, monkeypatch, one, drifting(one, 100.0)) == 1
    assert count_drawings(gl, monkeypatch, one, turning(one, np.radians(0.9))) == 1
    # Lit anew for each degree of 6 deg over the rows that it fills, 90 of 128 and some around.
    assert 4 <= count_drawings(gl, monkeypatch, one, turning(one, np.radians(6.0))) <= 6


def test_a_blur_is_drawn_once_where_the_light_stays(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    one, short = craft(5, exposure_time_s=READ_OUT), craft(5)
    assert count_drawings(gl, monkeypatch, one, drifting(one, 20.0)) == 1
    # 5.5 deg within the exposure, in steps of 1 deg, of the rows that turn by as much and are
    # drawn in as many parts.
    turned = count_drawings(gl, monkeypatch, one, turning(one, np.radians(5.5)))
    parts = count_drawings(gl, monkeypatch, short, turning(short, np.radians(5.5)))
    assert turned == 6 * parts


def test_a_moving_image_depends_on_no_earlier_one(gl: moderngl.Context) -> None:
    """Larger and smaller images, blurred and still ones, of turning and of distorted views."""
    one = craft(5, exposure_time_s=2e-3)
    larger = craft(5, exposure_time_s=2e-3, width_px=200, height_px=170)
    smaller = craft(9, width_px=50, height_px=60, optics={"distortion": {"k1": -0.2}})
    during = turning(one, np.radians(6.0))
    with Simulator(one, gl) as fresh:
        wanted = electrons(fresh, during(one.epoch_tai_ns), during)
    rest = one.at(one.epoch_tai_ns)
    with Simulator(one, gl) as simulator:
        for other in (larger, smaller):
            look = other.at(other.epoch_tai_ns).cameras
            for motion in (turning(other, np.radians(9.0)), drifting(other, 40.0)):
                electrons(simulator, motion(other.epoch_tai_ns), motion)
            electrons(simulator, replace(rest, cameras=look), None)
        seen = electrons(simulator, during(one.epoch_tai_ns), during)
    np.testing.assert_array_equal(seen, wanted)
