"""A box before a rolling shutter, and how far its rows are from images of their own times."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import moderngl
import numpy as np

from simgl.arrays import Array
from simgl.physics.frames import rotation_about, unit
from simgl.scenario.scenario import Scenario
from simgl.scene.state import SceneState
from simgl.simulator import Product, Simulator
from tests.scenes import lambert, scene

RANGE, ROWS, ROW_TIME = 100.0, 128, 100e-6
# 13 mm and 3.75 um.
FOCAL = 0.013 / 3.75e-6
READ_OUT = (ROWS - 1) * ROW_TIME
CAMERA = {
    "position_icrf_m": [0, 0, RANGE],
    "look_at": "craft",
    "up": [0.0, 1.0, 0.0],
    "shutter": "rolling",
    "row_time_us": 1e6 * ROW_TIME,
    "exposure_time_s": 1e-5,
}
BOX = {"box": {"size_m": [2.2, 2.6, 0.6], "material": lambert(0.5)}}
Motion = Callable[[int], SceneState]


def craft(samples: int = 60, **camera: object) -> Scenario:
    return scene(
        {"craft": {"model": BOX, "position_icrf_m": [0, 0, 0]}},
        CAMERA | camera,
        render={"samples_per_pixel": samples},
        sun_direction=(0.3, 0.2, 1.0),
    )


def turning(
    one: Scenario,
    angle: float,
    *,
    camera: bool = False,
    axis: tuple[float, float, float] = (0.2, 0.3, 0.9),
) -> Motion:
    """The craft, or the camera, turns by an angle [rad] while the rows are read out."""
    rest = one.at(one.epoch_tai_ns)
    look, body = rest.cameras["cam"], rest.bodies["craft"]
    about = unit(axis)

    def at(tai_ns: int) -> SceneState:
        R = rotation_about(about, angle * (tai_ns - one.epoch_tai_ns) * 1e-9 / READ_OUT)
        if camera:
            turned = replace(look, R_camera_from_icrf=look.R_camera_from_icrf @ R)
            return replace(rest, tai_ns=tai_ns, cameras={"cam": turned})
        pose = replace(body.pose, R_icrf_from_body=R @ body.pose.R_icrf_from_body)
        return replace(rest, tai_ns=tai_ns, bodies={"craft": replace(body, pose=pose)})

    return at


def drifting(one: Scenario, pixels: float, more: float = 0.0) -> Motion:
    """The craft crosses the picture along the camera's x while the rows are read out.

    more : px that it is further on at both ends of the read-out, as it accelerates
    """
    rest = one.at(one.epoch_tai_ns)
    right, body = rest.cameras["cam"].R_camera_from_icrf[0], rest.bodies["craft"]

    def at(tai_ns: int) -> SceneState:
        share = (tai_ns - one.epoch_tai_ns) * 1e-9 / READ_OUT
        way = (pixels * share + 4.0 * more * share**2) * RANGE / FOCAL
        pose = replace(body.pose, position=way * right)
        return replace(rest, tai_ns=tai_ns, bodies={"craft": replace(body, pose=pose)})

    return at


def electrons(simulator: Simulator, state: SceneState, during: Motion | None) -> Array:
    frame = simulator.capture(state, "cam", {Product.ELECTRONS}, during).electrons
    assert frame is not None
    return frame.electrons.astype(np.float64)


def row_errors(gl: moderngl.Context, one: Scenario, during: Motion) -> Array:
    """Of the middles of rows' light, against images of the scene at the rows' times [px].

    At three moments of longer exposures, weighted after Gauss: the mean of what changes evenly, and
    of its curve.
    """
    camera = one.at(one.epoch_tai_ns).cameras["cam"].camera
    x = np.arange(camera.detector.width) + 0.5
    count = 3 if camera.exposure_time > 10.0 * ROW_TIME else 1
    nodes, weights = np.polynomial.legendre.leggauss(count)
    errors = []
    with Simulator(one, gl) as simulator:
        image = electrons(simulator, during(one.epoch_tai_ns), during)
        for row in range(27, 104, 11):
            still = np.zeros(len(x))
            for node, weight in zip(nodes.tolist(), weights.tolist(), strict=True):
                seconds = (row - 63.5) * ROW_TIME + 0.5 * node * camera.exposure_time
                time = one.epoch_tai_ns + round(1e9 * seconds)
                still += weight * electrons(simulator, during(time), None)[row]
            seen = image[row]
            errors.append(seen @ x / seen.sum() - still @ x / still.sum())
    return np.array(errors)
