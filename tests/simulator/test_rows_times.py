"""Rolling shutters: what turns, what joints move, how often it is drawn, and that nothing stays."""

from __future__ import annotations

from dataclasses import replace

import moderngl
import numpy as np
import pytest
import trimesh

from simgl.model_files.model_from_mesh import model_from_mesh
from simgl.passes.visibility import VisibilityPass
from simgl.scenario.scenario import Scenario
from simgl.scene.materials import Material
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.state import SceneState
from simgl.simulator import Simulator
from tests.scenes import scene
from tests.simulator.blurred_scenes import box, moving
from tests.simulator.moving_scenes import (
    BOX,
    CAMERA,
    READ_OUT,
    ROW_TIME,
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


def tower() -> SpacecraftModel:
    """A tower on a plate."""
    plate, post = (trimesh.creation.box(size) for size in ((2.2, 2.6, 0.2), (0.3, 0.3, 1.6)))
    places = np.concatenate([plate.vertices, post.vertices])
    triangles = np.concatenate([plate.faces, post.faces + len(plate.vertices)])
    grey = Material(name="grey", reflectance=(0.5,) * 4, roughness=1.0)
    return model_from_mesh((places, triangles), materials=[grey], double_sided=False)


@pytest.mark.parametrize("camera", [False, True])
def test_rows_have_the_light_of_their_own_times(gl: moderngl.Context, camera: bool) -> None:
    """As a tower on a plate, or the camera, turns by 11 deg: shadows move by 3 px against those of
    the middle row, and the plate's light changes by 5 %."""
    one = scene(
        {"craft": {"model": BOX, "position_icrf_m": [0, 0, 0]}},
        CAMERA | {"width_px": 96, "position_icrf_m": [0, 0, 9.0], "focal_length_px": 312.0},
        sun_direction=(0.3, 0.8, 0.5),
        render={"samples_per_pixel": 16},
    )
    turns, model = (
        turning(one, np.radians(11.0), camera=camera, axis=(1.0 * camera, 0.3, 1.0 - camera)),
        tower(),
    )

    def during(tai_ns: int) -> SceneState:
        state = turns(tai_ns)
        return replace(state, bodies={"craft": replace(state.bodies["craft"], model=model)})

    with Simulator(one, gl) as simulator:
        image = electrons(simulator, during(one.epoch_tai_ns), during)
        for row in (25, 40, 64, 88, 103):
            time = one.epoch_tai_ns + round(1e9 * (row - 63.5) * ROW_TIME)
            still = electrons(simulator, during(time), None)[row]
            # The samples of edges.
            assert np.abs(image[row] - still).mean() <= 0.005 * still.max()


def count_drawings(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, one: Scenario, during: Motion
) -> int:
    drawn: list[object] = []
    draw = VisibilityPass.draw

    def counted(self: VisibilityPass, *given: object) -> tuple[moderngl.Texture, ...]:
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
    assert count_drawings(gl, monkeypatch, one, turning(one, np.radians(7.0))) == 1
    slew = turning(one, np.radians(9.0), camera=True)
    assert count_drawings(gl, monkeypatch, one, slew) == 1
    # The light between its surfaces is made anew for each 8 deg of 17 over the rows that it fills,
    # 90 of 128 and some around.
    assert 2 <= count_drawings(gl, monkeypatch, one, turning(one, np.radians(17.0))) <= 3


def test_a_blur_is_drawn_once_where_the_light_stays(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    one, short = craft(5, exposure_time_s=READ_OUT), craft(5)
    assert count_drawings(gl, monkeypatch, one, drifting(one, 20.0)) == 1
    # It turns back, 80 px on.
    assert count_drawings(gl, monkeypatch, box(), moving(box(), more=40.0)) == 1
    # 5.5 deg within the exposure.
    turned = count_drawings(gl, monkeypatch, one, turning(one, np.radians(5.5)))
    parts = count_drawings(gl, monkeypatch, short, turning(short, np.radians(5.5)))
    assert (turned, parts) == (1, 1)


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
