"""A trajectory's assessment: a row for each epoch, in a table that a broken run goes on with."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from simgl.assess.target_light import FrameAssessment, assess_frame
from simgl.assess.timeline import Moment
from simgl.assess.verdict import Verdict, verdict
from simgl.errors import ConfigError, did_you_mean
from simgl.output import check_writable
from simgl.physics.ephemeris import utc_from_tai_ns
from simgl.progress import ProgressCallback
from simgl.scenario.scenario import Scenario
from simgl.scenario.schema import UsabilityCriteria
from simgl.sequence.journal import Columns, Journal, Value
from simgl.sequence.run_sequence import identity
from simgl.simulator import Product, Simulator
from simgl.workers.frame_job import Crew

PRODUCTS = frozenset({Product.DN, Product.ELECTRONS, Product.RADIANCE, Product.TRUTH})

COLUMNS: Columns = {
    "frame": int,
    "utc": str,
    "tai_ns": int,
    "verdict": str,
    "reasons": str,
    "range_m": float,
    "phase_angle_deg": float,
    "sun_to_boresight_deg": float,
    "sunlight": float,
    "backdrop": str,
    "target_pixels": int,
    "cut_off": int,
    "saturated": float,
    "dark": float,
    "usable": float,
    "median_snr": float,
    "contrast": float,
    "radiance_r_w_m2_sr": float,
    "radiance_g_w_m2_sr": float,
    "radiance_b_w_m2_sr": float,
    "radiance_n_w_m2_sr": float,
    "exitance_w_m2": float,
    "relative_flux_w_m2": float,
    "median_electrons": float,
    "bright_electrons": float,
    "full_electrons": float,
    "better_exposure": float,
}


@dataclass(frozen=True, kw_only=True)
class Assignment:
    """What to assess.

    epochs : [TAI ns], in order
    """

    scenario: Scenario
    camera: str
    target: str
    epochs: Sequence[int]

    @property
    def limits(self) -> UsabilityCriteria:
        """What a usable picture keeps."""
        return self.scenario.criteria

    def take(self, simulator: Simulator, frame: int) -> dict[str, Value]:
        """The table's row of one epoch."""
        tai_ns = self.epochs[frame]
        state = self.scenario.at(tai_ns)
        exposure = simulator.capture(state, self.camera, PRODUCTS)
        return row_of(
            frame, tai_ns, assess_frame(exposure, state, self.target, self.limits), self.limits
        )


def assignment(
    scenario: Scenario, camera: str | None, target: str | None, epochs: Sequence[int]
) -> Assignment:
    """What to assess, by the names given, or those of the scenario's criteria, or its first ones.

    Raises ConfigError for names that are not there.
    """
    where = str(scenario.source or scenario.name)
    names = {}
    for kind, given, wanted, known in (
        ("camera", camera, scenario.criteria.camera, list(scenario.cameras)),
        ("target", target, scenario.criteria.target, list(scenario.models)),
    ):
        if not known:
            table = "camera" if kind == "camera" else "spacecraft"
            raise ConfigError(where, table, "is missing; an assessment needs one")
        name = given or wanted or known[0]
        if name not in known:
            problem = f'"{name}" is not in {where}; {did_you_mean(name, known)}'
            raise ConfigError("command line", f"--{kind}", problem)
        names[kind] = name
    return Assignment(
        scenario=scenario, camera=names["camera"], target=names["target"], epochs=epochs
    )


def run(
    work: Assignment,
    crew: Crew[dict[str, Value]],
    folder: Path,
    report: ProgressCallback | None = None,
) -> list[dict[str, Value]]:
    """Assess every epoch that the folder's table does not hold yet.

    report : told the epochs done and their number
    returns : all rows, in order
    Raises ConfigError for a folder that holds another assessment.
    """
    check_writable(folder)
    plan: dict[str, Value] = {
        "camera": work.camera,
        "target": work.target,
        "criteria": repr(work.limits),
    }
    content = plan | identity(work.scenario, work.epochs)
    with Journal(folder, content, COLUMNS, keys=1) as journal:
        done = {key for (key,) in journal.done()}
        missing = [frame for frame in range(len(work.epochs)) if frame not in done]
        if report is not None:
            report(len(work.epochs) - len(missing), len(work.epochs))
        if missing:
            with crew as taking:
                for count, row in enumerate(taking(missing), start=1):
                    journal.add(row)
                    if report is not None:
                        report(len(work.epochs) - len(missing) + count, len(work.epochs))
        journal.export(folder / "frames.csv")
        return list(journal.rows())


def row_of(
    frame: int, tai_ns: int, found: FrameAssessment, limits: UsabilityCriteria
) -> dict[str, Value]:
    """A row of the table."""
    judged, reasons = verdict(found, limits)
    values: list[Value] = [
        frame,
        utc_from_tai_ns(tai_ns),
        tai_ns,
        judged.value,
        "; ".join(reasons),
        found.range,
        math.degrees(found.phase_angle),
        math.degrees(found.sun_to_boresight),
        found.sunlight,
        found.backdrop.value,
        found.target_pixels,
        int(found.cut_off),
        found.saturated,
        found.dark,
        found.usable,
        found.median_snr,
        found.contrast,
        *found.mean_radiance,
        found.exitance,
        found.relative_flux,
        found.median_electrons,
        found.bright_electrons,
        found.full_electrons,
        found.better_exposure,
    ]
    return dict(zip(COLUMNS, values, strict=True))


def moments(rows: Sequence[dict[str, Value]]) -> list[Moment]:
    """Rows of the table as epochs of a course."""

    def number(row: dict[str, Value], name: str) -> float:
        return float(row[name] or 0.0)

    return [
        Moment(
            tai_ns=int(row["tai_ns"] or 0),
            verdict=Verdict(str(row["verdict"])),
            phase_angle=math.radians(number(row, "phase_angle_deg")),
            sunlight=number(row, "sunlight"),
            usable=number(row, "usable"),
            median_snr=number(row, "median_snr"),
            better_exposure=None
            if row["better_exposure"] is None
            else number(row, "better_exposure"),
        )
        for row in rows
    ]
