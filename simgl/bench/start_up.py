"""From the start of a process to its first DN, and to the end of ``simgl --help``."""

from __future__ import annotations

import statistics
import sys

from simgl.bench.child_process import ChildError, empty_caches, seconds_of
from simgl.bench.results import StartUp
from simgl.bench.scenes import scene_files
from simgl.progress import ProgressCallback, begin_stage

SCENE = "source_600"
_FIRST_DN = """
import sys, simgl
scenario = simgl.load_scenario(sys.argv[1])
with simgl.Simulator(scenario) as simulator:
    camera = next(iter(scenario.cameras))
    simulator.capture(scenario.at(scenario.epoch_tai_ns), camera)
"""
_REPEATS = 3
# Interreflection of a new model takes minutes on a slow machine.
_LIMIT_S = 600.0


def start_times(
    kinds: tuple[str, ...], progress: ProgressCallback
) -> tuple[StartUp, dict[str, str]]:
    """The kinds of start that are asked for, and of those that failed the reason."""
    measure = {"help": _help, "warm": _warm, "cold": _cold}
    seconds: dict[str, float] = {}
    failed: dict[str, str] = {}
    for kind in kinds:
        begin_stage(progress, f"start-up, {kind}")
        try:
            seconds[kind] = round(measure[kind](), 3)
        except ChildError as error:
            failed[f"start-up, {kind}"] = str(error)
    return StartUp(**seconds), failed


def _help() -> float:
    command = [sys.executable, "-m", "simgl", "--help"]
    return statistics.median(seconds_of(command, _LIMIT_S) for _ in range(_REPEATS))


def _first_dn() -> list[str]:
    return [sys.executable, "-c", _FIRST_DN, str(scene_files()[SCENE])]


def _warm() -> float:
    # The first of them fills the caches where they are empty.
    times = [seconds_of(_first_dn(), _LIMIT_S) for _ in range(1 + _REPEATS)]
    return statistics.median(times[1:])


def _cold() -> float:
    with empty_caches() as environment:
        return seconds_of(_first_dn(), _LIMIT_S, environment)
