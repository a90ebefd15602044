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
from simgl.progress import ProgressCallback
from simgl.scenario.scenario import Scenario
from simgl.sequence.journal import Columns, Journal, Value
from simgl.sequence.run_sequence import identity
from simgl.simulator import Simulator
from simgl.workers.frame_job import Crew

Row = dict[str, Value]


@dataclass(frozen=True)
class Sweep:
    """Every combination of some values at one epoch.

    work : whose only epoch is meant
    axes : those of the Sun first
    """

    work: Assignment
    axes: tuple[Axis, ...]

    @property
    def scenario(self) -> Scenario:
        """What a simulator is opened for."""
        return self.work.scenario

    @cached_property
    def lights(self) -> list[dict[str, float]]:
        """The combinations that need a picture each."""
        return _combinations([axis for axis in self.axes if axis.name in SUN_AXES])

    @cached_property
    def settings(self) -> list[dict[str, float]]:
        """The combinations that one picture serves."""
        return _combinations([axis for axis in self.axes if axis.name in CAMERA_AXES])

    def take(self, simulator: Simulator, frame: int) -> list[Row]:
        """The rows of one light."""
        light, work = self.lights[frame], self.work
        (tai_ns,) = work.epochs
        state = with_sun(self.scenario.at(tai_ns), work.camera, work.target, light)
        camera = state.cameras[work.camera].camera
        cameras = [with_setting(camera, setting) for setting in self.settings]
        taken = simulator.bracket(state, work.camera, cameras, PRODUCTS)
        rows = []
        for index, (setting, exposure) in enumerate(zip(self.settings, taken, strict=True)):
            point = frame * len(self.settings) + index
            found = row_of(
                point, tai_ns, assess_frame(exposure, state, work.target, work.limits), work.limits
            )
            values: Row = {_column(name): v for name, v in (light | setting).items()}
            rows.append(values | found)
        return rows

    @property
    def columns(self) -> Columns:
        """Of the table."""
        swept = {_column(axis.name): float for axis in self.axes}
        return {"frame": int, **swept, **COLUMNS}


def _column(name: str) -> str:
    """The phase angle that was asked for stands beside the one that was found."""
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
    sweep: Sweep,
    crew: Crew[list[Row]],
    folder: Path,
    report: ProgressCallback | None = None,
) -> list[Row]:
    """Assess every point that the folder's table does not hold yet.

    report : told the points done and their number
    returns : all rows, the last axis the fastest
    Raises ConfigError for a folder that holds something else.
    """
    check_writable(folder)
    work, each = sweep.work, len(sweep.settings)
    content: dict[str, Value] = {
        "camera": work.camera,
        "target": work.target,
        "criteria": repr(work.limits),
        "sweep": repr(sweep.axes),
    }
    content |= identity(work.scenario, work.epochs)
    with Journal(folder, content, sweep.columns, keys=1) as journal:
        done = {key for (key,) in journal.done()}
        missing = [
            light
            for light in range(len(sweep.lights))
            if not done.issuperset(range(light * each, (light + 1) * each))
        ]
        total, ready = each * len(sweep.lights), each * (len(sweep.lights) - len(missing))
        if report is not None:
            report(ready, total)
        if missing:
            with crew as taking:
                for rows in taking(missing):
                    for row in rows:
                        journal.add(row)
                    ready += each
                    if report is not None:
                        report(ready, total)
        journal.export(folder / "frames.csv")
        return list(journal.rows())
