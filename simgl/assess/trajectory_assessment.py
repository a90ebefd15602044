"""A trajectory's assessment: a row for each epoch, in a table that lets a run be resumed."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from simgl.assess.target_light import FrameAssessment, assess_frame
from simgl.assess.timeline import Moment
from simgl.assess.verdict import Verdict, verdict
from simgl.errors import ConfigError, did_you_mean
from simgl.output import check_writable
from simgl.physics.ephemeris import utc_from_tai_ns
from simgl.progress import ProgressCallback, silent
from simgl.scenario.scenario import Scenario
from simgl.scenario.schema import UsabilityCriteria
from simgl.scene.state import SceneState
from simgl.sequence.journal import Columns, Journal, Row, Value, run_missing
from simgl.sequence.run_sequence import identity
from simgl.simulator import Capture, Product, Simulator
from simgl.workers.frame_job import Executor

PRODUCTS = frozenset({Product.DN, Product.ELECTRONS, Product.RADIANCE, Product.TRUTH})
_THERMAL_PRODUCTS = frozenset({Product.DN, Product.THERMAL, Product.TRUTH})

_Quantity = tuple[type[str] | type[int] | type[float], Callable[[FrameAssessment], Value]]


def _degrees(angle: float | None) -> float | None:
    return None if angle is None else math.degrees(angle)


def _band(assessment: FrameAssessment, number: int) -> float | None:
    radiance = assessment.mean_radiance
    return None if radiance is None else radiance[number]


def _lvlh_columns() -> dict[str, _Quantity]:
    """Vectors of the geometry in the target's LVLH axes, a column for each component."""

    def column(name: str, axis: int) -> Callable[[FrameAssessment], Value]:
        def value(assessment: FrameAssessment) -> Value:
            vector = getattr(assessment.geometry, name)
            return None if vector is None else float(vector[axis])

        return value

    names = {"camera_lvlh": "camera_{}_lvlh_m", "boresight_lvlh": "boresight_{}_lvlh",
             "sun_lvlh": "sun_{}_lvlh"}  # fmt: skip
    return {
        text.format(letter): (float, column(name, axis))
        for name, text in names.items()
        for axis, letter in enumerate("xyz")
    }


# Columns after number, epoch, verdict and reasons: type, and value from the assessment.
_QUANTITIES: dict[str, _Quantity] = {
    "range_m": (float, lambda a: a.range),
    "phase_angle_deg": (float, lambda a: math.degrees(a.phase_angle)),
    "sun_to_boresight_deg": (float, lambda a: math.degrees(a.sun_to_boresight)),
    "sun_exclusion_deg": (float, lambda a: _degrees(a.sun_exclusion)),
    "earth_limb_deg": (float, lambda a: _degrees(a.geometry.earth_limb_angle)),
    "beta_angle_deg": (float, lambda a: _degrees(a.geometry.beta_angle)),
    "latitude_deg": (float, lambda a: _degrees(a.geometry.latitude)),
    "longitude_deg": (float, lambda a: _degrees(a.geometry.longitude)),
    "altitude_m": (float, lambda a: a.geometry.altitude),
    "sunlight": (float, lambda a: a.sunlight),
    "backdrop": (str, lambda a: a.backdrop.value),
    "target_pixels": (int, lambda a: a.target_pixels),
    "cut_off": (int, lambda a: int(a.cut_off)),
    "target_size_px": (int, lambda a: a.size_px),
    "edge_distance_px": (int, lambda a: a.edge_distance_px),
    "saturated": (float, lambda a: a.saturated),
    "dark": (float, lambda a: a.dark),
    "usable": (float, lambda a: a.usable),
    "median_snr": (float, lambda a: a.median_snr),
    "contrast": (float, lambda a: a.contrast),
    "radiance_r_w_m2_sr": (float, lambda a: _band(a, 0)),
    "radiance_g_w_m2_sr": (float, lambda a: _band(a, 1)),
    "radiance_b_w_m2_sr": (float, lambda a: _band(a, 2)),
    "radiance_n_w_m2_sr": (float, lambda a: _band(a, 3)),
    "exitance_w_m2": (float, lambda a: a.exitance),
    "relative_flux_w_m2": (float, lambda a: a.relative_flux),
    "median_electrons": (float, lambda a: a.median_electrons),
    "bright_electrons": (float, lambda a: a.bright_electrons),
    "full_electrons": (float, lambda a: a.full_electrons),
    "better_exposure": (float, lambda a: a.better_exposure),
    **_lvlh_columns(),
}
COLUMNS: Columns = {
    "frame": int,
    "utc": str,
    "tai_ns": int,
    "verdict": str,
    "reasons": str,
} | {name: kind for name, (kind, _) in _QUANTITIES.items()}
# Those that a thermal camera has besides [K], and the field of ``TargetTemperatures`` of each.
_TEMPERATURES = {
    "target_lowest_k": "lowest",
    "target_mean_k": "mean",
    "target_highest_k": "highest",
    "target_brightness_k": "brightness",
    "background_brightness_k": "background",
    "netd_k": "netd",
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
        """Limits of a usable image."""
        return self.scenario.criteria

    def content(self) -> dict[str, Value | Mapping[str, str]]:
        """Identity of the assessment, for its journal."""
        return {
            "camera": self.camera,
            "target": self.target,
            "criteria": repr(self.limits),
        } | identity(self.scenario, self.epochs)

    @property
    def is_thermal(self) -> bool:
        """Whether the camera sees thermal radiation."""
        return self.scenario.cameras[self.camera].thermal is not None

    @property
    def other_cameras(self) -> tuple[str, ...]:
        """Cameras of the other kind, thermal or visible, whose images stand beside."""
        return tuple(
            name
            for name, camera in self.scenario.cameras.items()
            if (camera.thermal is not None) != self.is_thermal
        )

    @property
    def columns(self) -> Columns:
        """Of the table."""
        return {**COLUMNS, **(dict.fromkeys(_TEMPERATURES, float) if self.is_thermal else {})}

    def capture(self, simulator: Simulator, tai_ns: int) -> tuple[SceneState, Capture]:
        """A state and what the camera captures of it, standing still."""
        state = self.scenario.at(tai_ns)
        if not self.is_thermal:
            return state, simulator.capture(state, self.camera, PRODUCTS)
        warm = simulator.temperatures.at(tai_ns)
        seen = simulator.capture(state, self.camera, _THERMAL_PRODUCTS, temperatures=warm)
        return state, seen

    def render(self, simulator: Simulator, frame: int) -> Row:
        """The table's row of one epoch."""
        tai_ns = self.epochs[frame]
        state, capture = self.capture(simulator, tai_ns)
        assessment = assess_frame(capture, state, self.target, self.limits)
        row = row_of(frame, tai_ns, assessment, self.limits)
        return row | temperature_row(assessment) if self.is_thermal else row


def assignment(
    scenario: Scenario, camera: str | None, target: str | None, epochs: Sequence[int]
) -> Assignment:
    """What to assess: the camera and target given, else those of the criteria, else the first.

    Raises ConfigError for names that the scenario does not have.
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
    work: Assignment, executor: Executor[Row], folder: Path, progress: ProgressCallback = silent
) -> list[Row]:
    """Assess every epoch that the folder's table does not hold yet.

    progress : receives the epochs done and their number
    returns : all rows, in order
    Raises ConfigError for a folder that holds another assessment.
    """
    check_writable(folder)
    with Journal(folder, work.content(), work.columns, keys=1) as journal:
        done = {key for (key,) in journal.done()}
        missing = [frame for frame in range(len(work.epochs)) if frame not in done]
        run_missing(missing, len(work.epochs), executor, journal.add, progress)
        journal.export(folder / "frames.csv")
        return list(journal.rows())


def row_of(frame: int, tai_ns: int, assessment: FrameAssessment, limits: UsabilityCriteria) -> Row:
    """A row of the table."""
    kind, reasons = verdict(assessment, limits)
    row: Row = {
        "frame": frame,
        "utc": utc_from_tai_ns(tai_ns),
        "tai_ns": tai_ns,
        "verdict": kind.value,
        "reasons": "; ".join(reasons),
    }
    return row | {name: value(assessment) for name, (_, value) in _QUANTITIES.items()}


def temperature_row(assessment: FrameAssessment) -> Row:
    """The columns of a thermal camera."""
    temperatures = assessment.temperatures
    return {
        n: None if temperatures is None else getattr(temperatures, f)
        for n, f in _TEMPERATURES.items()
    }


def assessment_document(work: Assignment, assessment: FrameAssessment) -> dict[str, object]:
    """The assessment of the first epoch as ``simgl assess --json`` prints it."""
    names = {"scenario": work.scenario.name, "camera": work.camera, "target": work.target}
    temperatures = temperature_row(assessment) if work.is_thermal else {}
    return {**names, **row_of(0, work.epochs[0], assessment, work.limits), **temperatures}


def run_document(work: Assignment, rows: Sequence[Row], report: Path) -> dict[str, object]:
    """The table of a run as ``simgl assess --json`` prints it."""
    names = {"scenario": work.scenario.name, "camera": work.camera, "target": work.target}
    return {**names, "report": str(report), "rows": list(rows)}


def moments(rows: Sequence[Row]) -> list[Moment]:
    """Rows of the table as epochs of a timeline."""

    def number(row: Row, name: str) -> float:
        return float(row[name] or 0.0)

    return [
        Moment(
            tai_ns=int(row["tai_ns"] or 0),
            verdict=Verdict(str(row["verdict"])),
            phase_angle=math.radians(number(row, "phase_angle_deg")),
            sunlight=number(row, "sunlight"),
            usable=number(row, "usable"),
            median_snr=number(row, "median_snr"),
            better_exposure=None if (factor := row["better_exposure"]) is None else float(factor),
        )
        for row in rows
    ]
