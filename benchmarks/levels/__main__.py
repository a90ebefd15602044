"""``python -m benchmarks.levels --out FILE.json``: frames of far spacecraft from all triangles and
from fewer, turn by turn in one run; by processor time, which other work on the machine leaves
alone, and how far the pictures are from each other."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
import typer

from benchmarks.record import write_record
from simgl.bench import scene_files
from simgl.output import check_writable
from simgl.scenario.loader import load_scenario
from simgl.scenario.scenario import Scenario
from simgl.simulator import Product, Simulator

BOUND = 0.25
WARM_UP, STEP_NS = 4, 1_000_000_000


class Case(msgspec.Struct, frozen=True, kw_only=True):
    """Medians of a frame [ms], all triangles before, fewer after; the second over the first.

    flux, difference : of the radiance, sum over sum, and sum of absolute differences over sum
    """

    name: str
    frames: int
    cpu_ms: tuple[float, float]
    wall_ms: tuple[float, float]
    cpu_ratio: float
    passes_ms: dict[str, tuple[float, float]]
    flux: float
    difference: float


class Record(msgspec.Struct, frozen=True, kw_only=True):
    """What the file holds."""

    renderer: str
    bound_px: float
    cases: list[Case]


def measured(scenario: Scenario, frames: int) -> tuple[str, Case]:
    """Renderer, and one scene with and without levels of detail."""
    camera = next(iter(scenario.cameras))
    pair = [Simulator(replace(scenario, level_error_px=bound)) for bound in (0.0, BOUND)]
    cpu: list[list[float]] = [[], []]
    wall: list[list[float]] = [[], []]
    for i in range(WARM_UP + frames):
        state = scenario.at(scenario.epoch_tai_ns + i * STEP_NS)
        for k, simulator in enumerate(pair):
            start = time.perf_counter(), time.process_time()
            simulator.capture(state, camera)
            if i >= WARM_UP:
                wall[k].append(1e3 * (time.perf_counter() - start[0]))
                cpu[k].append(1e3 * (time.process_time() - start[1]))
    passes: list[dict[str, list[float]]] = [{}, {}]
    for i in range(WARM_UP + frames // 2):
        state = scenario.at(scenario.epoch_tai_ns + i * STEP_NS)
        for simulator, runs in zip(pair, passes, strict=True):
            simulator.timer.enabled = True
            simulator.timer.seconds.clear()
            simulator.capture(state, camera)
            for name, seconds in simulator.timer.seconds.items():
                runs.setdefault(name, []).append(1e3 * seconds)
    state = scenario.at(scenario.epoch_tai_ns)
    pictures = []
    for simulator in pair:
        frame = simulator.capture(state, camera, {Product.RADIANCE}).radiance
        assert frame is not None
        pictures.append(frame.radiance.astype(np.float64))
        renderer = simulator.renderer_name
        simulator.close()

    def two(values: list[list[float]]) -> tuple[float, float]:
        first, second = (round(float(np.median(v)), 1) for v in values)
        return first, second

    of_cpu = two(cpu)
    return renderer, Case(
        name=scenario.name,
        frames=frames,
        cpu_ms=of_cpu,
        wall_ms=two(wall),
        cpu_ratio=round(of_cpu[1] / of_cpu[0], 3),
        passes_ms={
            name: two([passes[0][name], passes[1][name]]) for name in ("shadow", "geometry")
        },
        flux=round(float(pictures[1].sum() / pictures[0].sum()), 5),
        difference=round(float(np.abs(pictures[1] - pictures[0]).sum() / pictures[0].sum()), 5),
    )


def main(
    out: Annotated[Path, typer.Option(help="the record, JSON")],
    frames: Annotated[int, typer.Option(min=1)] = 20,
) -> None:
    """Measure and write."""
    check_writable(out.parent)
    source = load_scenario(scene_files()["source_600"])
    dark = replace(source, name="source_600 without inter_reflection", inter_reflection=False)
    cases, renderer = [], ""
    for scenario in (source, dark):
        renderer, case = measured(scenario, frames)
        cases.append(case)
    record = Record(
        renderer=renderer,
        bound_px=BOUND,
        cases=cases,
    )
    write_record(out, record)


if __name__ == "__main__":
    typer.run(main)
