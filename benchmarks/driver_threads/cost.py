"""What frames cost where llvmpipe draws without threads: LP_NUM_THREADS=0 against its default.

python -m benchmarks.driver_threads.cost --out FILE.json [--turns 20] [--scene source_600]

Two processes hold the same scene. In turns of some frames, one and then the other, both draw the
same epochs, 0.1 s apart; the ratio is of their medians.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection
from pathlib import Path

import msgspec
import numpy as np

from benchmarks.record import load, write_record
from simgl import Simulator, load_scenario
from simgl.bench.scenes import bench_scenes

_STEP_NS = 10**8
_FRAMES_OF_A_TURN = 6
_WARM_UP = 10
_VARIABLE = "LP_NUM_THREADS"


class Cost(msgspec.Struct, frozen=True, kw_only=True):
    """Frames of one scene with the default's threads and without; medians of all frames [ms].

    ratio : of the wall times of a turn, without threads over with them; median of the turns
    load : of the machine before and after; this benchmark itself adds between 1 and its cores
    """

    frames: int
    with_threads_ms: float
    without_ms: float
    with_threads_cpu_ms: float
    without_cpu_ms: float
    ratio: float
    ratio_quartiles: tuple[float, float]
    load: tuple[float, float]


def _draw(name: str, link: Connection) -> None:
    """Answer numbers of first frames with the wall and CPU times of a turn [ms]."""
    scenario = load_scenario(bench_scenes()[name].path)
    camera = next(iter(scenario.cameras))
    with Simulator(scenario) as simulator:

        def frame(number: int) -> tuple[float, float]:
            wall, cpu = time.perf_counter(), time.process_time()
            simulator.capture(scenario.at(scenario.epoch_tai_ns + number * _STEP_NS), camera)
            return 1e3 * (time.perf_counter() - wall), 1e3 * (time.process_time() - cpu)

        for number in range(_WARM_UP):
            frame(number)
        link.send(None)
        while (first := link.recv()) is not None:
            link.send([frame(first + number) for number in range(_FRAMES_OF_A_TURN)])


@contextmanager
def _drawing(name: str, threads: str | None) -> Iterator[Connection]:
    """A process that draws, with so many threads of the driver; None for its default."""
    link, link_of_process = multiprocessing.Pipe()
    os.environ.pop(_VARIABLE, None)
    if threads is not None:
        os.environ[_VARIABLE] = threads
    process = multiprocessing.get_context("spawn").Process(
        target=_draw, args=(name, link_of_process)
    )
    process.start()
    link_of_process.close()
    try:
        link.recv()
        yield link
    finally:
        link.send(None)
        process.join()


def measure(name: str, turns: int) -> Cost:
    """Alternate between both."""
    before, times = load(), []
    with _drawing(name, None) as default, _drawing(name, "0") as without:
        for turn in range(turns):
            both = []
            # Who begins changes, since other work on the machine comes and goes.
            pair = (default, without) if turn % 2 == 0 else (without, default)
            for link in pair:
                link.send(_WARM_UP + turn * _FRAMES_OF_A_TURN)
                both.append(link.recv())
            times.append(both if turn % 2 == 0 else both[::-1])
    # Turns, default and without, frames, wall and CPU.
    values = np.array(times)
    (wall, cpu), (wall_0, cpu_0) = np.median(values, axis=(0, 2)).tolist()
    of_turns = np.median(values[..., 0], axis=2)
    ratios = of_turns[:, 1] / of_turns[:, 0]
    low, middle, high = np.percentile(ratios, (25, 50, 75)).round(3).tolist()
    return Cost(
        frames=turns * _FRAMES_OF_A_TURN,
        with_threads_ms=round(wall, 1),
        without_ms=round(wall_0, 1),
        with_threads_cpu_ms=round(cpu, 1),
        without_cpu_ms=round(cpu_0, 1),
        ratio=middle,
        ratio_quartiles=(low, high),
        load=(before, load()),
    )


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.driver_threads.cost")
    parser.add_argument("--scene", nargs="+", default=["source_600", "stars_600"])
    parser.add_argument("--turns", type=int, default=20)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    costs = {}
    for name in options.scene:
        costs[name] = measure(name, options.turns)
        print(name, costs[name], flush=True)
        write_record(options.out, {"cost": costs})


if __name__ == "__main__":
    main()
