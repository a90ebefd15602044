"""Memory over long runs: a moving arm, changing scenarios, simulators opened and closed.

LP_NUM_THREADS=0 python -m benchmarks.soak [--arm 600] [--scenes 10000] [--sessions 300]

Three parts, each in a process of its own, with its memory and OpenGL objects at equal steps:

    arm        one simulator: a joint of ``examples/servicer.toml`` and the exposure move
    scenes     one simulator: each frame is of another scenario, read from files written for it
    sessions   each frame has a scenario and a simulator of its own, half of which fail to open

Memory grows while caches fill; the slopes are of the last two thirds, with their standard errors.
What is resident holds what the C library keeps for later beside what is in use.
"""

from __future__ import annotations

import argparse
import ctypes
import json
import re
import tempfile
import time
import tomllib
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager, suppress
from multiprocessing import get_context
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
from simgl.rendering.renderer import Renderer
from simgl.scenario.loader import scenario_from_dict
from simgl.scenario.scenario import Scenario
from tests.watched_context import WatchedContext

ROOT = Path(__file__).parents[1]
SERVICER = ROOT / "examples" / "servicer.toml"
CAMERA = "beside"
PRODUCTS = frozenset({Product.DN, Product.RADIANCE})
# Values are noted so many times in a part.
NOTES = 100

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
samples_per_pixel = 5
"""


class Slope(msgspec.Struct, frozen=True, kw_only=True):
    """Growth of memory [kB a frame] and its standard error."""

    kb_a_frame: float
    error: float


class Series(msgspec.Struct):
    """What a part found: memory and OpenGL objects after each of ``noted`` frames.

    resident_mb : of the process [MB]
    in_use_mb : what the C library gave out and was not given back [MB]; the driver and NumPy ask
        it for all they have, Python for what is larger than 512 bytes
    slopes : of both, after the first third
    cpu_s : of all frames
    """

    frames: int
    noted: list[int] = []
    resident_mb: list[float] = []
    in_use_mb: list[float] = []
    opengl_objects: list[int] = []
    slopes: dict[str, Slope] = {}
    cpu_s: float = 0.0


_libc = ctypes.CDLL(None)
_libc.open_memstream.restype = ctypes.c_void_p


def in_use_mb() -> float:
    """What glibc's malloc gave out, in all of its arenas [MB]."""
    text, size = ctypes.c_char_p(), ctypes.c_size_t()
    stream = ctypes.c_void_p(_libc.open_memstream(ctypes.byref(text), ctypes.byref(size)))
    _libc.malloc_info(0, stream)
    _libc.fclose(stream)
    # After the heaps come the sums over them.
    sums = (text.value or b"").decode().rpartition("</heap>")[2]
    _libc.free(text)
    free = sum(map(int, re.findall(r'type="(?:fast|rest)" count="\d+" size="(\d+)"', sums)))
    mapped = sum(map(int, re.findall(r'type="mmap" count="\d+" size="(\d+)"', sums)))
    (system,) = re.findall(r'<system type="current" size="(\d+)"', sums)
    return (int(system) + mapped - free) / 1e6


def slope(frames: list[int], values_mb: list[float]) -> Slope:
    """By least squares over the last two thirds."""
    first = len(frames) // 3
    (steepness, _), covariance = np.polyfit(frames[first:], values_mb[first:], 1, cov=True)
    return Slope(
        kb_a_frame=round(1e3 * float(steepness), 2),
        error=round(1e3 * float(np.sqrt(covariance[0, 0])), 2),
    )


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
    begin = time.process_time()
    for frame in range(frames):
        draw(frame)
        if frame in notes:
            series.noted.append(frame)
            series.resident_mb.append(round(resident_mb(), 1))
            series.in_use_mb.append(round(in_use_mb(), 1))
            series.opengl_objects.append(living())
            last = series.resident_mb[-1], series.in_use_mb[-1], series.opengl_objects[-1]
            print(json.dumps([frame, *last]), flush=True)
    series.cpu_s = round(time.process_time() - begin, 1)
    series.slopes = {
        "resident": slope(series.noted, series.resident_mb),
        "in_use": slope(series.noted, series.in_use_mb),
    }
    return series


def arm(frames: int, _: Path) -> Series:
    """A joint goes to and fro over its range; the exposure changes with every frame."""
    data = tomllib.loads(SERVICER.read_text())
    data["camera"][CAMERA] |= {"width_px": 160, "height_px": 116}
    scenario = scenario_from_dict(data, source=SERVICER)
    joints = {joint.name: joint for joint in scenario.models["servicer"].joints}
    low, high = np.clip(joints[JOINT].limits, -np.pi, np.pi)
    poses = scenario.poses(scenario.epoch_tai_ns)
    with watched() as (ctx, living), Simulator(scenario, ctx) as simulator:

        def draw(frame: int) -> None:
            # By less than a degree a frame: the way there meets each pose of the quick light.
            angle = low + (0.5 - 0.5 * np.cos(0.008 * frame)) * (high - low)
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
            # Of the lit side: a crescent gets more samples, and the first of them a program.
            azimuth=rng.uniform(20.0, 150.0),
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
    parser.add_argument("--arm", type=int, default=600)
    parser.add_argument("--scenes", type=int, default=10_000)
    parser.add_argument("--sessions", type=int, default=300)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    results: dict[str, Series] = {}
    with (
        tempfile.TemporaryDirectory() as folder,
        ProcessPoolExecutor(1, get_context("spawn"), max_tasks_per_child=1) as processes,
    ):
        for measure in (arm, scenes, sessions):
            part = measure.__name__
            if frames := getattr(options, part):
                print(part, flush=True)
                results[part] = processes.submit(measure, frames, Path(folder)).result()
                if options.out is not None:
                    write_record(options.out, {"parts": results})


if __name__ == "__main__":
    main()
