"""Memory over long runs: a moving arm, changing scenarios, simulators opened and closed.

python -m benchmarks.soak [--arm 3000] [--scenes 10000] [--sessions 300] [--out FILE]

Three parts, each with one process' memory and its OpenGL objects at equal steps:

    arm        one simulator: a joint of ``examples/servicer.toml`` and the exposure move
    scenes     one simulator: each frame is of another scenario, read from files written for it
    sessions   each frame has a scenario and a simulator of its own, half of which fail to open
"""

from __future__ import annotations

import argparse
import json
import tempfile
import tomllib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from unittest.mock import patch

import moderngl
import msgspec
import numpy as np
import trimesh

from benchmarks.joints import JOINT, resident_mb
from benchmarks.record import write_record
from simgl import Product, Simulator, load_scenario
from simgl.camera.presets import preset_path
from simgl.errors import SimglError
from simgl.gpu.context import current
from simgl.renderer import Renderer
from simgl.scenario.loader import scenario_from_dict
from simgl.scenario.scenario import Scenario
from tests.watched_context import WatchedContext

ROOT = Path(__file__).parents[1]
SERVICER = ROOT / "examples" / "servicer.toml"
CAMERA = "beside"
PRODUCTS = frozenset({Product.DN, Product.RADIANCE})
# Values are noted so many times in a part.
NOTES = 10

SCENE = """\
[epoch]
utc = "2026-03-20T12:00:00"
[earth]
albedo = 0.3
[spacecraft.rock]
model = "rock.obj"
orbit = {{ altitude_km = {altitude:.3f} }}
[spacecraft.crate]
model.box = {{ size_m = [1.0, 2.0, {depth:.6f}], material = {{ reflectance = {reflectance:.4f} }} }}
relative_to = "rock"
position_lvlh_m = [0.0, 4.0, 0.0]
[camera.cam]
preset = "mine.toml"
width_px = {width}
height_px = 48
exposure_time_s = {exposure:.6e}
focal_length_mm = 4.0
about = {{ target = "rock", azimuth_deg = {azimuth:.2f}, range_m = 9.0 }}
optics.distortion.k1 = {k1:.5f}
[render]
inter_reflection = false
"""


class Series(msgspec.Struct):
    """What a part found: memory [MB] and OpenGL objects at equal steps from the first frame on."""

    frames: int
    resident_mb: list[float] = []
    opengl_objects: list[int] = []


@contextmanager
def watched() -> Iterator[tuple[moderngl.Context, Callable[[], int]]]:
    """A context, and how many objects live in it."""
    watch = WatchedContext()
    try:
        with current(watch.ctx):
            yield watch.ctx, lambda: sum(watch.living.values())
    finally:
        watch.release()


def run(frames: int, draw: Callable[[int], None], living: Callable[[], int]) -> Series:
    """Draw frames by their number, and note memory."""
    series = Series(frames)
    notes = set(np.linspace(0, frames - 1, NOTES + 1).round().astype(int).tolist())
    for frame in range(frames):
        draw(frame)
        if frame in notes:
            series.resident_mb.append(round(resident_mb(), 1))
            series.opengl_objects.append(living())
            print(
                json.dumps([frame, series.resident_mb[-1], series.opengl_objects[-1]]), flush=True
            )
    return series


def arm(frames: int) -> Series:
    """A joint goes to and fro over its range; the exposure changes with every frame."""
    data = tomllib.loads(SERVICER.read_text())
    data["camera"][CAMERA] |= {"width_px": 160, "height_px": 116}
    scenario = scenario_from_dict(data, source=SERVICER)
    joints = {joint.name: joint for joint in scenario.models["servicer"].joints}
    low, high = np.clip(joints[JOINT].limits, -np.pi, np.pi)
    poses = scenario.poses(scenario.epoch_tai_ns)
    with watched() as (ctx, living), Simulator(scenario, ctx) as simulator:

        def draw(frame: int) -> None:
            angle = low + (0.5 - 0.5 * np.cos(0.02 * frame)) * (high - low)
            exposure = 1e-3 * (1.1 + np.sin(0.1 * frame))
            state = scenario.with_poses(
                scenario.epoch_tai_ns + 10**9 * frame,
                poses,
                exposure_times={CAMERA: float(exposure)},
                joint_angles={"servicer": {JOINT: float(angle)}},
            )
            simulator.capture(state, CAMERA, PRODUCTS)

        return run(frames, draw, living)


def write_files(folder: Path, number: int) -> Path:
    """A scenario of its own for each number, with its mesh and its preset; returns its path."""
    rng = np.random.default_rng(number)
    sphere = trimesh.creation.icosphere(subdivisions=1)
    sphere.vertices *= rng.uniform(0.5, 2.0, 3)
    (folder / "rock.obj").write_text(sphere.export(file_type="obj"))
    preset = preset_path("mt9m034").read_text()
    (folder / "mine.toml").write_text(preset + f"# {number}\n")
    path = folder / "scene.toml"
    path.write_text(
        SCENE.format(
            # Seldom, since tables of the air are made for each.
            altitude=300.0 + number // 20,
            depth=rng.uniform(0.5, 2.0),
            reflectance=rng.uniform(0.1, 0.9),
            width=int(rng.integers(48, 96)),
            exposure=rng.uniform(1e-4, 1e-2),
            azimuth=rng.uniform(0.0, 360.0),
            k1=rng.uniform(-0.02, 0.02),
        )
    )
    return path


def capture(simulator: Simulator, scenario: Scenario) -> None:
    """Everything that a frame needs is drawn."""
    simulator.capture(scenario.at(scenario.epoch_tai_ns), "cam", PRODUCTS)


def scenes(frames: int, folder: Path) -> Series:
    """One simulator, whose scenario changes with every frame."""
    first = load_scenario(write_files(folder, 0))
    with watched() as (ctx, living), Simulator(first, ctx) as simulator:

        def draw(frame: int) -> None:
            simulator.scenario = load_scenario(write_files(folder, frame))
            capture(simulator, simulator.scenario)

        return run(frames, draw, living)


def sessions(frames: int, folder: Path) -> Series:
    """A simulator for each frame, in one context; every other one cannot be opened."""

    refused = patch.object(Renderer, "prepare", side_effect=SimglError("cannot be prepared"))

    with watched() as (ctx, living):

        def draw(frame: int) -> None:
            scenario = load_scenario(write_files(folder, frame))
            if frame % 2 == 0:
                with Simulator(scenario, ctx) as simulator:
                    capture(simulator, scenario)
                return
            with refused, suppress(SimglError):
                Simulator(scenario, ctx)
                raise AssertionError("opened all the same")

        return run(frames, draw, living)


def main() -> None:
    """Measure, print and record."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.soak")
    parser.add_argument("--arm", type=int, default=3000)
    parser.add_argument("--scenes", type=int, default=10_000)
    parser.add_argument("--sessions", type=int, default=300)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    results: dict[str, Series] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        parts: dict[str, Callable[[int], Series]] = {
            "arm": arm,
            "scenes": lambda frames: scenes(frames, folder),
            "sessions": lambda frames: sessions(frames, folder),
        }
        for part, measure in parts.items():
            if frames := getattr(options, part):
                print(part, flush=True)
                results[part] = measure(frames)
    if options.out is not None:
        write_record(options.out, {part: msgspec.to_builtins(s) for part, s in results.items()})


if __name__ == "__main__":
    main()
