"""``python -m benchmarks.moving_cost``: CPU time of images of what moves, over that of still ones.

A box that is small, large and fills the image drifts over the read-out of a rolling shutter, and
within the exposure of a global one. With ``--turns`` a box and Space Rider turn and accelerate, and
the camera turns. Still and moving images take turns; run it with
``LP_NUM_THREADS=0``, so that the time of the renderer counts as this process's own.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Annotated

import numpy as np
import typer
from rich.console import Console

from simgl.gpu.context import temporary_context
from simgl.physics.frames import rotation_about, unit
from simgl.scenario.scenario import Scenario
from simgl.scene.state import SceneState
from simgl.simulator import Product, Simulator
from tests.scenes import Table, lambert, scene

_FOCAL_PX = 13e-3 / 3.75e-6
_SIZE, _ROW_TIME = (640, 480), 20e-6
_READ_OUT = (_SIZE[1] - 1) * _ROW_TIME
_BOX = {"box": {"size_m": [2.2, 2.6, 0.6], "material": lambert(0.5)}}
_RANGES = {"small": 250.0, "large": 40.0, "filling the image": 6.0}
_DRIFTS_PX = (25.0, 200.0)

# Of a spacecraft that turns.
_TURN_AXIS = (0.2, 0.3, 0.9)

Axis = tuple[float, float, float]
Motion = Callable[[int], SceneState]


def _scenario(range_m: float, shutter: str, exposure: float, model: str | Table = _BOX) -> Scenario:
    camera = {
        "position_icrf_m": [0, 0, range_m],
        "look_at": "craft",
        "up": [0.0, 1.0, 0.0],
        "width_px": _SIZE[0],
        "height_px": _SIZE[1],
        "exposure_time_s": exposure,
        "shutter": shutter,
    }
    if shutter == "rolling":
        camera["row_time_us"] = 1e6 * _ROW_TIME
    bodies = {"craft": {"model": model, "position_icrf_m": [0, 0, 0]}}
    return scene(bodies, camera, sun_direction=(0.3, 0.2, 1.0))


def _drifting(
    scenario: Scenario, range_m: float, drift_px: float, during_s: float, more_px: float = 0.0
) -> Motion:
    """The box crosses the image along its rows, by so many pixels in a time.

    more_px : that it is further on at both ends of it, as it accelerates
    """
    rest = scenario.at(scenario.epoch_tai_ns)
    body, right = rest.bodies["craft"], rest.cameras["cam"].R_camera_from_icrf[0]

    def at(tai_ns: int) -> SceneState:
        share = (tai_ns - scenario.epoch_tai_ns) * 1e-9 / during_s
        way_px = drift_px * share + 4.0 * more_px * share**2
        pose = replace(body.pose, position=way_px * range_m / _FOCAL_PX * right)
        return replace(rest, tai_ns=tai_ns, bodies={"craft": replace(body, pose=pose)})

    return at


def _turning(
    scenario: Scenario, angle_deg: float, during_s: float, camera_axis: Axis | None = None
) -> Motion:
    """The spacecraft turns by so much in a time, or the camera about one of its axes."""
    rest = scenario.at(scenario.epoch_tai_ns)
    body, camera = rest.bodies["craft"], rest.cameras["cam"]
    axis = unit(_TURN_AXIS if camera_axis is None else camera_axis)

    def at(tai_ns: int) -> SceneState:
        share = (tai_ns - scenario.epoch_tai_ns) * 1e-9 / during_s
        R = rotation_about(axis, np.radians(angle_deg) * share)
        if camera_axis is not None:
            turned = replace(camera, R_camera_from_icrf=R @ camera.R_camera_from_icrf)
            return replace(rest, tai_ns=tai_ns, cameras={"cam": turned})
        pose = replace(body.pose, R_icrf_from_body=R @ body.pose.R_icrf_from_body)
        return replace(rest, tai_ns=tai_ns, bodies={"craft": replace(body, pose=pose)})

    return at


def _turns(range_m: float, model: str | Table) -> dict[str, tuple[Scenario, Motion]]:
    """Turns and accelerated ways over the read-out, and within an exposure."""
    cases = {}
    for name, shutter, exposure, length in (
        ("rolling shutter", "rolling", 1e-5, _READ_OUT),
        ("motion blur", "global", 1e-2, 1e-2),
    ):
        one = _scenario(range_m, shutter, exposure, model)
        for angle in (10.0, 30.0):
            cases[f"{name}, turn by {angle:g} deg"] = one, _turning(one, angle, length)
        for what, angle, axis in (("slew", 2.0, (0.0, 1.0, 0.0)), ("roll", 10.0, (0.0, 0.0, 1.0))):
            way = _turning(one, angle, length, axis)
            cases[f"{name}, {what} of the camera by {angle:g} deg"] = one, way
        for drift, more in ((0.0, 40.0), (60.0, 40.0), (20.0, 5.0)):
            way = _drifting(one, range_m, drift, length, more)
            cases[f"{name}, {drift:g} px, and {more:g} px more at the ends"] = one, way
    return cases


def _cpu_s(simulator: Simulator, scenario: Scenario, during: Motion | None) -> float:
    simulator.scenario = scenario
    start = time.process_time()
    simulator.capture(scenario.at(scenario.epoch_tai_ns), "cam", {Product.DN}, during)
    return time.process_time() - start


def main(
    repeats: Annotated[int, typer.Option(help="Pairs of each case.")] = 5,
    blur: Annotated[bool, typer.Option(help="Motion blur too, which takes minutes.")] = True,
    turns: Annotated[
        bool, typer.Option(help="Turns and accelerated ways in place of drifts.")
    ] = False,
) -> None:
    """Print the ratios, medians over pairs."""
    if turns:
        for model, range_m in ((_BOX, 40.0), ("space_rider", 20.0)):
            name = model if isinstance(model, str) else "box"
            still = _scenario(range_m, "global", 1e-5, model)
            _print_ratios(name, still, _turns(range_m, model), repeats)
        return
    for name, range_m in _RANGES.items():
        still = _scenario(range_m, "global", 1e-5)
        # No row sees anything move within its own exposure.
        rolling, exposed = _scenario(range_m, "rolling", 1e-5), _scenario(range_m, "global", 1e-2)
        cases = {}
        for drift in _DRIFTS_PX:
            way = _drifting(rolling, range_m, drift, _READ_OUT)
            cases[f"rolling shutter, {drift:g} px"] = rolling, way
            if blur:
                way = _drifting(exposed, range_m, drift, 1e-2)
                cases[f"motion blur, {drift:g} px"] = exposed, way
        _print_ratios(name, still, cases, repeats)


def _print_ratios(
    name: str, still: Scenario, cases: dict[str, tuple[Scenario, Motion]], repeats: int
) -> None:
    console = Console()
    with temporary_context() as gl, Simulator(still, gl) as simulator:
        _cpu_s(simulator, still, None)
        for case, (scenario, during) in cases.items():
            _cpu_s(simulator, scenario, during)
            pairs = [
                _cpu_s(simulator, scenario, during) / _cpu_s(simulator, still, None)
                for _ in range(repeats)
            ]
            console.print(f"{name}, {case}: {np.median(pairs):.2f}")


if __name__ == "__main__":
    typer.run(main)
