"""``GALLIUM_NOOP=1 python -m benchmarks.python_time``: CPU time of the main thread per frame.

Mesa's driver "noop" draws nothing: what is left is Python, numpy, moderngl and Mesa's own part, on
the way that a frame takes on a GPU. What is read back is undefined, but for whether there was room
for all shading points, and for the number of very bright pixels, which are set here.
"""

from __future__ import annotations

import time
from unittest.mock import patch

import moderngl
import numpy as np

from simgl import Simulator, load_scenario
from simgl.bench.scenes import bench_scenes
from simgl.passes.compute_spread import ComputeSpreadPass
from simgl.passes.page_numbers import PageNumbers
from simgl.passes.vertex_sums import VertexSums

# All that run on whatever is read back; frames before those that count, and those.
_SCENES = (
    *("source_600", "bay_1280", "docking_3m", "docking_20m"),
    *("square_2048", "camera_1280", "four_cameras", "earth_1280"),
)
_BEFORE, _FRAMES, _STEP_NS = 8, 40, 100_000_000
_reserved, _ask = VertexSums._reserved, PageNumbers.lacked_room


def _lacked_room(numbers: PageNumbers) -> bool:
    """There was room, whatever is read back."""
    _ask(numbers)
    return False


def _of_size(sums: VertexSums, use: str, nbytes: int) -> moderngl.Buffer:
    """A buffer of just so many bytes: this driver fails to write a part of a larger one."""
    return _reserved(sums, f"{use} {nbytes}", nbytes)


def main_thread_ms(name: str) -> float:
    """10th percentile over frames of a scene, for other work on the machine only adds [ms]."""
    scene, times = bench_scenes()[name], []
    scenario = load_scenario(scene.path)
    with Simulator(scenario) as simulator:
        if "NOOP" not in simulator.renderer_name:
            raise SystemExit(f"set GALLIUM_NOOP=1: {simulator.renderer_name} draws")
        for frame in range(_BEFORE + _FRAMES):
            start = time.thread_time()
            state = scenario.at(scenario.epoch_tai_ns + frame * _STEP_NS)
            for camera in scene.cameras(list(scenario.cameras), frame):
                simulator.capture(state, camera)
            times.append(1e3 * (time.thread_time() - start))
    return float(np.percentile(times[_BEFORE:], 10))


if __name__ == "__main__":
    nothing_bright = patch.object(ComputeSpreadPass, "_bright_area", lambda _: None)
    exact_sizes = patch.object(VertexSums, "_reserved", _of_size)
    room_enough = patch.object(PageNumbers, "lacked_room", _lacked_room)
    with nothing_bright, exact_sizes, room_enough:
        for one in _SCENES:
            print(f"{one} {main_thread_ms(one):.1f} ms", flush=True)
