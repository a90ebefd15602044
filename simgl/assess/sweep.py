"""An assessment over Sun angles, exposures and apertures: a table with a row for each of them."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from simgl.assess.sweep_axes import CAMERA_AXES, SUN_AXES, Axis, with_setting, with_sun
from simgl.assess.target_light import assess_frame
from simgl.assess.trajectory_assessment import COLUMNS, PRODUCTS, Assignment, row_of
from simgl.output import check_writable
from simgl.progress import ProgressCallback, silent
from simgl.scenario.scenario import Scenario
from simgl.sequence.journal import Columns, Journal, Row, Value, run_missing
from simgl.simulator import Simulator
from simgl.workers.frame_job import Executor


@dataclass(frozen=True)
class Sweep:
    """Every combination of some values at one epoch.

    work : of one epoch
    axes : those of the Sun first
    """

    work: Assignment
    axes: tuple[Axis, ...]

    @property
    def scenario(self) -> Scenario:
        """Scenario that the simulators are opened for."""
        return self.work.scenario

    @cached_property
    def sun_directions(self) -> list[dict[str, float]]:
        """The combinations that need a rendered frame each."""
        return _combinations([axis for axis in self.axes if axis.name in SUN_AXES])

    @cached_property
    def settings(self) -> list[dict[str, float]]:
        """The combinations that share a rendered frame."""
        return _combinations([axis for axis in self.axes if axis.name in CAMERA_AXES])

    def render(self, simulator: Simulator, frame: int) -> list[Row]:
        """The rows of one direction of the Sun."""
        sun, work = self.sun_directions[frame], self.work
        (tai_ns,) = work.epochs
        state = with_sun(self.scenario.at(tai_ns), work.camera, work.target, sun)
        camera = state.cameras[work.camera].camera
        cameras = [with_setting(camera, setting) for setting in self.settings]
        first = frame * len(self.settings)
        # Every point has its own noise, numbered as in the table.
        captures = simulator.bracket(state, work.camera, cameras, PRODUCTS, first_draw=first)
        rows = []
        for index, (setting, capture) in enumerate(zip(self.settings, captures, strict=True)):
            assessment = assess_frame(capture, state, work.target, work.limits)
            swept: Row = {_column(name): value for name, value in (sun | setting).items()}
            rows.append(swept | row_of(first + index, tai_ns, assessment, work.limits))
        return rows

    @property
    def columns(self) -> Columns:
        """Of the table."""
        swept = {_column(axis.name): float for axis in self.axes}
        return {"frame": int, **swept, **COLUMNS}


def _column(name: str) -> str:
    """The phase angle asked for has a column of its own beside the one of the image."""
    return f"sweep_{name}"


def swept(row: Mapping[str, Value], axis: Axis) -> float:
    """The value of an axis in a row."""
    return float(row[_column(axis.name)] or 0.0)


def _combinations(axes: list[Axis]) -> list[dict[str, float]]:
    names = [axis.name for axis in axes]
    return [
        dict(zip(names, values, strict=True))
        for values in itertools.product(*(axis.values for axis in axes))
    ]


def run_sweep(
    sweep: Sweep, executor: Executor[list[Row]], folder: Path, progress: ProgressCallback = silent
) -> list[Row]:
    """Assess every point that the folder's table does not hold yet.

    progress : receives the points done and their number
    returns : all rows, the last axis the fastest
    Raises ConfigError for a folder that holds something else.
    """
    check_writable(folder)
    content = sweep.work.content() | {"sweep": repr(sweep.axes)}
    each, count = len(sweep.settings), len(sweep.sun_directions)
    with Journal(folder, content, sweep.columns, keys=1) as journal:
        done = {key for (key,) in journal.done()}
        missing = [
            frame
            for frame in range(count)
            if not done.issuperset(range(frame * each, (frame + 1) * each))
        ]

        def store(rows: list[Row]) -> None:
            for row in rows:
                journal.add(row)

        def points(done: int, total: int) -> None:
            progress(done * each, total * each)

        run_missing(missing, count, executor, store, points)
        journal.export(folder / "frames.csv")
        return list(journal.rows())
