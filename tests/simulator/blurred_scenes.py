"""A box before a global shutter, blurred by its motion within the exposure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from simgl.scenario.scenario import Scenario
from simgl.scene.state import SceneState
from tests.scenes import Table, scene
from tests.simulator.moving_scenes import BOX, FOCAL, RANGE, Motion

EXPOSURE = 0.01
CAMERA: Table = {
    "position_icrf_m": [0, 0, RANGE],
    "look_at": "craft",
    "up": [0.0, 1.0, 0.0],
    "shutter": "global",
    "exposure_time_s": EXPOSURE,
}


def before(camera: Table, models: Mapping[str, Table]) -> Scenario:
    """Spacecraft in deep space, "craft" a metre before the others."""
    bodies = {
        name: {"model": model, "position_icrf_m": [0, 0, 0.0 if name == "craft" else -1.0]}
        for name, model in models.items()
    }
    render = {"samples_per_pixel": 30}
    return scene(bodies, CAMERA | camera, render=render, sun_direction=(0.3, 0.2, 1.0))


def box(**camera: object) -> Scenario:
    return before(camera, {"craft": BOX})


def moving(
    one: Scenario,
    right: float = 0.0,
    down: float = 0.0,
    *,
    nearer: float = 0.0,
    from_x: float = 0.0,
    more: float = 0.0,
) -> Motion:
    """The craft moves across the image [px], and nearer by a share of its range, per exposure.

    more : how much further to the right it is at both ends of the exposure, as it accelerates [px]
    from_x : where it is in the middle of it, from the image's middle [px]
    """
    rest = one.at(one.epoch_tai_ns)
    body, axes = rest.bodies["craft"], rest.cameras["cam"].R_camera_from_icrf
    step = RANGE * np.array([right / FOCAL, down / FOCAL, -nearer]) @ axes
    middle = body.pose.position + RANGE * from_x / FOCAL * axes[0]

    def at(tai_ns: int) -> SceneState:
        share = (tai_ns - one.epoch_tai_ns) * 1e-9 / EXPOSURE
        way = step * share + 4.0 * share**2 * more * RANGE / FOCAL * axes[0]
        moved = replace(body, pose=replace(body.pose, position=middle + way))
        return replace(rest, tai_ns=tai_ns, bodies={**rest.bodies, "craft": moved})

    return at
