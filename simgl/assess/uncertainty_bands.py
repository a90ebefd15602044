"""Bands of an assessment's quantities and margins, from Monte Carlo draws."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array
from simgl.assess.requirement_check import Check, Outcome, check_requirements, in_unit
from simgl.assess.uncertainty_draws import UncertaintyDraw, UncertaintyRun
from simgl.assess.verdict import verdict
from simgl.physics.ephemeris import utc_from_tai_ns
from simgl.scenario.requirements import Requirement
from simgl.scenario.schema import UsabilityCriteria
from simgl.sequence.journal import Row

PERCENTILES = (5.0, 50.0, 95.0)
# Of the probability that a requirement is kept, from the number of draws that keep it.
_CONFIDENCE = 0.95
_INFINITE = float("inf")
# Columns that draws change in proportion: a factor varies less over time than a difference.
_PROPORTIONAL = (
    "median_electrons", "bright_electrons", "median_snr", "exitance_w_m2", "relative_flux_w_m2",
    *(f"radiance_{band}_w_m2_sr" for band in "rgbn"),
)  # fmt: skip
# Columns that draws shift, and the range of their values.
_SHIFTED = {
    "target_pixels": (0.0, _INFINITE),
    "target_size_px": (0.0, _INFINITE),
    "edge_distance_px": (0.0, _INFINITE),
    "saturated": (0.0, 1.0),
    "dark": (0.0, 1.0),
    "usable": (0.0, 1.0),
    "contrast": (0.0, 1.0),
    "sun_to_boresight_deg": (0.0, 180.0),
    "sun_exclusion_deg": (0.0, 180.0),
    "earth_limb_deg": (-180.0, 180.0),
    "phase_angle_deg": (0.0, 180.0),
}


@dataclass(frozen=True, kw_only=True)
class RequirementSpread:
    """A requirement over all draws.

    passing, draws : how many draws keep it, of how many
    probability : bounds of the probability that it is kept (Wilson, 95 %)
    margins : 5, 50 and 95 % of its margin over the draws; None where no draw is judged
    worst : the draw of the smallest margin; None where none is worse than the others
    worst_margin : the smallest one
    """

    requirement: Requirement
    passing: int
    draws: int
    probability: tuple[float, float]
    margins: tuple[float, float, float] | None
    worst: UncertaintyDraw | None
    worst_margin: float | None


@dataclass(frozen=True, kw_only=True)
class UncertaintyBands:
    """What the draws of a run say together.

    run : what was drawn
    epochs : at how many epochs each draw was rendered
    bands : (3, rows) 5, 50 and 95 % of a column, by its name; NaN where it has no value
    spreads : of each requirement
    checks : of each draw, in the order of the requirements
    all_passing : draws that keep every requirement
    """

    run: UncertaintyRun
    epochs: int
    bands: Mapping[str, Array]
    spreads: Sequence[RequirementSpread]
    checks: Sequence[Sequence[Check]]
    all_passing: int


def uncertainty_bands(
    run: UncertaintyRun, rows: Sequence[Row], drawn: Sequence[Row]
) -> UncertaintyBands:
    """Bands over all epochs, and each requirement over all draws.

    rows : of the run itself, at all epochs
    drawn : rows of all draws at the epochs chosen
    """
    count = len(run.chosen)
    worlds = [
        rows_of_draw(rows, run.chosen, drawn[first : first + count], run.work.limits)
        for first in range(0, len(drawn), count)
    ]
    checks = [check_requirements(run.scenario.requirements, world) for world in worlds]
    draws = run.draws()
    spreads = [
        requirement_spread(draws, [of_draw[index] for of_draw in checks])
        for index in range(len(run.scenario.requirements))
    ]
    names = (*_PROPORTIONAL, *_SHIFTED)
    return UncertaintyBands(
        run=run,
        epochs=count,
        bands={
            name: _band(np.array([_numbers(world, name) for world in worlds])) for name in names
        },
        spreads=spreads,
        checks=checks,
        all_passing=sum(all(c.outcome is Outcome.PASS for c in of_draw) for of_draw in checks),
    )


def _band(values: Array) -> Array:
    """(3, rows) percentiles of (draws, rows); columns without a value stay NaN."""
    known = np.isfinite(values).all(axis=0)
    band = np.full((len(PERCENTILES), values.shape[1]), np.nan)
    band[:, known] = np.percentile(values[:, known], PERCENTILES, axis=0)
    return band


def _numbers(rows: Sequence[Row], name: str) -> Array:
    return np.array([np.nan if (value := row[name]) is None else float(value) for row in rows])


@dataclass(frozen=True)
class _ImageFigures:
    """What a verdict needs to know."""

    target_pixels: int
    saturated: float
    dark: float
    median_snr: float
    contrast: float | None


def rows_of_draw(
    rows: Sequence[Row], chosen: Sequence[int], drawn: Sequence[Row], limits: UsabilityCriteria
) -> list[Row]:
    """The table of a run as one draw has it.

    rows : of the run, at all epochs
    chosen : numbers of the epochs at which ``drawn`` has rows of the draw

    What the draw changes at the epochs chosen is interpolated over time between them: a factor for
    amounts of light, a difference for the rest. The verdicts follow from the values.
    """
    times = np.array([int(row["tai_ns"] or 0) for row in rows], dtype=np.float64)
    at, values = times[list(chosen)], {}
    for name in (*_PROPORTIONAL, *_SHIFTED):
        usual, of_draw = _numbers(rows, name), _numbers(drawn, name)
        before = usual[list(chosen)]
        if name in _SHIFTED:
            change = _interpolated(times, at, of_draw - before, 0.0)
            values[name] = np.clip(usual + change, *_SHIFTED[name])
        else:
            lit = before > 0.0
            factor = np.divide(of_draw, before, out=np.ones_like(before), where=lit)
            values[name] = usual * _interpolated(times, at, factor, 1.0)
    columns = {
        name: [None if np.isnan(v) else v for v in of_name.tolist()]
        for name, of_name in values.items()
    }
    return [
        _judged({**row, **{name: column[index] for name, column in columns.items()}}, limits)
        for index, row in enumerate(rows)
    ]


def _judged(row: Row, limits: UsabilityCriteria) -> Row:
    """A row with the verdict on its values."""
    contrast = row["contrast"]
    figures = _ImageFigures(
        target_pixels=round(float(row["target_pixels"] or 0)),
        saturated=float(row["saturated"] or 0.0),
        dark=float(row["dark"] or 0.0),
        median_snr=float(row["median_snr"] or 0.0),
        contrast=None if contrast is None else float(contrast),
    )
    kind, reasons = verdict(figures, limits)
    return {**row, "verdict": kind.value, "reasons": "; ".join(reasons)}


def _interpolated(times: Array, at: Array, values: Array, usual: float) -> Array:
    """Values over time, the ends constant; the usual one where none is known."""
    known = np.isfinite(values)
    if not known.any():
        return np.full_like(times, usual)
    return np.interp(times, at[known], values[known])


def requirement_spread(
    draws: Sequence[UncertaintyDraw], checks: Sequence[Check]
) -> RequirementSpread:
    """A requirement's checks, one for each draw, taken together."""
    from scipy.stats import binomtest

    passing = sum(check.outcome is Outcome.PASS for check in checks)
    interval = binomtest(passing, len(checks)).proportion_ci(_CONFIDENCE, method="wilson")
    judged = [
        (check.margin, draw)
        for draw, check in zip(draws, checks, strict=True)
        if check.margin is not None
    ]
    margins, worst, worst_margin = None, None, None
    if judged:
        low, middle, high = np.percentile([m for m, _ in judged], PERCENTILES).tolist()
        margins = low, middle, high
        worst_margin, worst = min(judged, key=lambda one: (one[0], one[1].number))
        if all(margin == worst_margin for margin, _ in judged):
            worst = None
    return RequirementSpread(
        requirement=checks[0].requirement,
        passing=passing,
        draws=len(checks),
        probability=(float(interval.low), float(interval.high)),
        margins=margins,
        worst=worst,
        worst_margin=worst_margin,
    )


def spread_row(spread: RequirementSpread) -> dict[str, object]:
    """A requirement's spread as a row of uncertainty.csv, and of the JSON document."""
    low, middle, high = spread.margins or (None, None, None)
    return {
        "requirement": spread.requirement.key,
        "unit": spread.requirement.of.unit,
        "draws": spread.draws,
        "passing": spread.passing,
        "probability": spread.passing / spread.draws,
        "probability_low": spread.probability[0],
        "probability_high": spread.probability[1],
        "margin_p5": low,
        "margin_p50": middle,
        "margin_p95": high,
        "worst_draw": None if spread.worst is None else spread.worst.number,
        "worst_margin": spread.worst_margin,
    }


def draw_rows(bands: UncertaintyBands) -> Iterator[dict[str, object]]:
    """Rows of uncertainty_draws.csv: the errors of each draw, and its margins."""
    for draw, checks in zip(bands.run.draws(), bands.checks, strict=True):
        row: dict[str, object] = {
            "draw": draw.number,
            "albedo_factor": draw.albedo,
            "exposure_factor": draw.exposure,
        }
        for name in ("attitude", "pointing"):
            for letter, angle in zip("xyz", np.degrees(getattr(draw, name)), strict=True):
                row[f"{name}_{letter}_deg"] = float(angle)
        row["cloud_seed"] = draw.cloud_seed
        yield row | {f"margin_{check.requirement.key}": check.margin for check in checks}


def band_rows(bands: UncertaintyBands, rows: Sequence[Row]) -> Iterator[dict[str, object]]:
    """Rows of uncertainty_bands.csv: percentiles of each column at each epoch."""
    for index, row in enumerate(rows):
        named: dict[str, object] = {
            "frame": row["frame"],
            "utc": utc_from_tai_ns(int(row["tai_ns"] or 0)),
        }
        for name, band in bands.bands.items():
            for percentile, value in zip(PERCENTILES, band[:, index].tolist(), strict=True):
                named[f"{name}_p{percentile:.0f}"] = None if np.isnan(value) else value
        yield named


def draw_text(draw: UncertaintyDraw) -> str:
    """The errors of a draw in words."""
    parts = [f"albedo × {draw.albedo:.3g}", f"exposure × {draw.exposure:.3g}"]
    for name, vector in (("target turned", draw.attitude), ("camera turned", draw.pointing)):
        if any(vector):
            parts.append(f"{name} {np.degrees(np.linalg.norm(vector)):.2g} deg")
    return ", ".join(parts)


def bands_document(bands: UncertaintyBands | None) -> Mapping[str, object]:
    """The draws as ``simgl assess --json`` prints them; nothing without draws."""
    if bands is None:
        return {}
    return {
        "uncertainty": {
            "draws": bands.run.table.draws,
            "all_passing": bands.all_passing,
            "requirements": [spread_row(spread) for spread in bands.spreads],
        }
    }


def bands_text(bands: UncertaintyBands | None) -> list[str]:
    """A line for each requirement over the draws, for a terminal."""
    lines = []
    for spread in bands.spreads if bands is not None else ():
        one = spread.requirement
        line = f"{spread.passing} of {spread.draws} draws keep {one.key}"
        if spread.margins is not None:
            low, _, high = (in_unit(one, margin, signed=True) for margin in spread.margins)
            line += f": margin {low} to {high} (5 to 95 %)"
        lines.append(line)
    return lines
