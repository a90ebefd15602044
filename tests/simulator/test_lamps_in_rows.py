"""Light of lamps on what moves while a rolling shutter exposes one row after the other."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.physics.frames import rotation_about
from simgl.scenario.scenario import Scenario
from simgl.scene.lamps import lamp_state
from simgl.scene.state import SceneState
from simgl.simulator import Simulator
from tests.scenes import lambert, scene
from tests.simulator.moving_scenes import Motion, electrons

SIZE, ROW_TIME = 96, 1e-3
ON_CHASER = {"on": "chaser", "position_body_m": [0, 0, 0.12], "boresight": [0, 0, 1]}
ON_THIRD = {"on": "third", "position_body_m": [0, 0, 0.06], "boresight": [-0.7, 0, 0.7]}
Places = dict[str, tuple[float, float, float]]


def wall(*lamps: dict[str, Any]) -> Scenario:
    """A wall 10 m before a camera, in the dark but for lamps, and a third spacecraft beside it."""

    def box(place: tuple[float, float, float], *size: float) -> dict[str, Any]:
        model = {"box": {"size_m": list(size), "material": lambert(0.6)}}
        return {"model": model, "position_icrf_m": list(place)}

    beam = {"half_angle_deg": 20.0, "edge_deg": 0.5, "power_w": [1.0, 1.0, 1.0, 1.0]}
    camera = {**ON_CHASER, "up": [0, 1, 0], "focal_length_mm": 6.0, "pixel_pitch_um": 20.0}
    return scene(
        {
            "chaser": box((0, 0, 0), 0.2, 0.2, 0.2),
            "wall": box((0, 0, 10.25), 2.0, 2.0, 0.5),
            "third": box((2.5, 0.3, 7.5), 0.1, 0.1, 0.1),
        },
        {
            **camera,
            "width_px": SIZE,
            "height_px": SIZE,
            "exposure_time_s": 1e-4,
            "shutter": "rolling",
            "row_time_us": 1e6 * ROW_TIME,
        },
        sun={"irradiance_w_m2": 0.0},
        lamp={f"lamp{i}": {**beam, **one} for i, one in enumerate(lamps)},
        render={"inter_reflection": False, "samples_per_pixel": 16},
    )


def moving(one: Scenario, velocities: Places, turn_rate: float) -> Motion:
    """Spacecraft fly [m/s], and the wall turns about the camera's y axis [rad/s]."""
    rest = one.at(one.epoch_tai_ns)

    def at(tai_ns: int) -> SceneState:
        seconds = (tai_ns - one.epoch_tai_ns) * 1e-9
        bodies = dict(rest.bodies)
        for name, body in rest.bodies.items():
            way = seconds * np.array(velocities.get(name, (0.0, 0.0, 0.0)))
            R = body.pose.R_icrf_from_body
            if name == "wall":
                R = rotation_about(np.array([0.0, 1.0, 0.0]), turn_rate * seconds) @ R
            pose = replace(body.pose, position=body.pose.position + way, R_icrf_from_body=R)
            bodies[name] = replace(body, pose=pose)
        poses = {name: body.pose for name, body in bodies.items()}
        flown = poses["chaser"].position - rest.bodies["chaser"].pose.position
        camera = rest.cameras["cam"]
        return replace(
            rest,
            tai_ns=tai_ns,
            bodies=bodies,
            lamps=tuple(lamp_state(one.lamp, poses) for one in rest.lamps),
            cameras={"cam": replace(camera, position=camera.position + flown)},
        )

    return at


@pytest.mark.parametrize(
    ("lamps", "velocities", "turn_rate"),
    [
        ([ON_CHASER], {"wall": (0.0, 0.0, 10.0)}, 0.0),
        ([ON_CHASER], {"wall": (0.0, 0.0, -0.5)}, 0.0),
        ([ON_CHASER], {"chaser": (0.0, 1.0, 5.0)}, 0.0),
        ([ON_CHASER], {}, 5.0),
        # The wall stands still before the camera.
        ([ON_THIRD], {"third": (0.0, 0.0, 10.0)}, 0.0),
        ([ON_CHASER | {"half_angle_deg": 3.0}], {"wall": (3.0, 0.0, -5.0)}, 0.0),
        ([ON_THIRD, ON_CHASER], {"third": (0.0, 2.0, 1.0), "wall": (0.0, 0.0, 5.0)}, 0.0),
    ],
)
def test_rows_have_the_light_of_lamps_at_their_own_times(
    gl: moderngl.Context, lamps: list[dict[str, Any]], velocities: Places, turn_rate: float
) -> None:
    """As images of those times. With lamps' places and maps of the middle row a surface that moves
    by more than 0.1 mm against its lamp shades itself, and loses half of its rows."""
    one = wall(*lamps)
    during = moving(one, velocities, turn_rate)
    with Simulator(one, gl) as simulator:
        image = electrons(simulator, during(one.epoch_tai_ns), during)
        for row in (24, 40, 56, 70):
            time = one.epoch_tai_ns + round(1e9 * (row - 0.5 * SIZE + 0.5) * ROW_TIME)
            still = electrons(simulator, during(time), None)[row]
            # The wall's two edges in a row are sampled to a quarter of a pixel each.
            assert np.abs(image[row] - still).mean() <= 0.5 / SIZE * still.max()
