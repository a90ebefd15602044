"""``python -m benchmarks.illumination``: CPU time of a frame over that of one with plain sunlight.

Plain is sunlight without penumbrae, no light of the Earth on spacecraft, and none between surfaces.
Frames of both are drawn in turn.
"""

from __future__ import annotations

import argparse
import time
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from simgl import Simulator, load_scenario
from simgl.arrays import Array
from simgl.bench.scenes import bench_scenes
from simgl.passes.shared_blocks import shadow_values
from simgl.sample_grid import SampleGrid
from simgl.scenario.loader import scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.view.spacecraft_view import SpacecraftView

# Frames before those that count, and those; 0.1 s apart.
_BEFORE, _FRAMES, _STEP_NS = 5, 12, 100_000_000


def plain(path: Path) -> Scenario:
    """A scenario without interreflection."""
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    data["render"] = data.get("render", {}) | {"inter_reflection": False}
    return scenario_from_dict(data, source=path)


def _point_sun(view: SpacecraftView, sample_grid: SampleGrid) -> dict[str, Any]:
    """The Shadow block of a Sun that is a point to all casters, in the direction of its maps: a
    small Sun would ask for maps of its own in every frame."""
    values = shadow_values(view, sample_grid)
    values["shadow_atlas"][:, 3] = 1e-6
    values["shadow_lean"] = np.zeros(2)
    return values


@contextmanager
def light(*, is_plain: bool) -> Iterator[None]:
    """Frames in it have plain light, or all."""
    if not is_plain:
        yield
        return
    without_sky = patch("simgl.view.spacecraft_view.sky_view", lambda *_: None)
    with without_sky, patch("simgl.passes.view_blocks.shadow_values", _point_sun):
        yield


def cpu_ms(name: str) -> tuple[Array, Array]:
    """(frames,) of a scene with all light, and plain [ms]."""
    scene = bench_scenes()[name]
    every, simple = load_scenario(scene.path), plain(scene.path)
    times: tuple[list[float], list[float]] = ([], [])
    with Simulator(every) as first, Simulator(simple) as second:
        for frame in range(_BEFORE + _FRAMES):
            ways = (every, first, False), (simple, second, True)
            for (scenario, simulator, is_plain), taken in zip(ways, times, strict=True):
                with light(is_plain=is_plain):
                    start = time.process_time()
                    state = scenario.at(scenario.epoch_tai_ns + frame * _STEP_NS)
                    for camera in scene.cameras(list(scenario.cameras), frame):
                        simulator.capture(state, camera)
                    taken.append(1e3 * (time.process_time() - start))
    return np.array(times[0][_BEFORE:]), np.array(times[1][_BEFORE:])


def main() -> None:
    """Print medians, and their ratio."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("scenes", nargs="*", default=["source_600", "bay_1280", "earth_1280"])
    for name in parser.parse_args().scenes:
        every, simple = (float(np.median(taken)) for taken in cpu_ms(name))
        print(f"{name}: {every:.0f} ms, plain {simple:.0f} ms, {every / simple:.2f} times")


if __name__ == "__main__":
    main()
