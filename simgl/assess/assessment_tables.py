"""The tables of an assessment as CSV, beside its page."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path

from simgl.assess.model_limits import ModelLimit
from simgl.assess.requirement_check import Check, check_row
from simgl.assess.timeline import Timeline
from simgl.assess.uncertainty_bands import UncertaintyBands, band_rows, draw_rows, spread_row
from simgl.output import complete_file
from simgl.physics.ephemeris import utc_from_tai_ns
from simgl.sequence.journal import Row


def write_table(path: Path, rows: Sequence[Mapping[str, object]], names: Sequence[str]) -> None:
    """Rows as comma-separated values with a header, also where there are none."""
    with complete_file(path) as temporary, temporary.open("w", newline="") as file:
        writer = csv.DictWriter(file, names)
        writer.writeheader()
        writer.writerows(rows)


def write_tables(
    folder: Path,
    facts: Mapping[str, str],
    checks: Sequence[Check],
    summary: Timeline,
    limits: Sequence[ModelLimit],
) -> None:
    """provenance.csv, requirements.csv, stretches.csv and not_modelled.csv.

    facts : of ``provenance``, and the hash of each input file by its name
    """
    pairs = [{"name": name, "value": value} for name, value in facts.items()]
    write_table(folder / "provenance.csv", pairs, ("name", "value"))
    judged = [check_row(check) for check in checks]
    for row in judged:
        worst = row["worst_tai_ns"]
        row["worst_utc"] = utc_from_tai_ns(worst) if isinstance(worst, int) else None
    if judged:
        write_table(folder / "requirements.csv", judged, list(judged[0]))
    stretches = [
        {
            "verdict": window.verdict.value,
            "start_utc": utc_from_tai_ns(window.start_ns),
            "stop_utc": utc_from_tai_ns(window.stop_ns),
            "duration_s": window.duration,
            "epochs": window.epochs,
        }
        for window in summary.windows
    ]
    write_table(folder / "stretches.csv", stretches, list(stretches[0]))
    texts = [{"what": one.what, "text": one.text, "epochs": one.epochs} for one in limits]
    write_table(folder / "not_modelled.csv", texts, ("what", "text", "epochs"))


def write_uncertainty_tables(folder: Path, bands: UncertaintyBands, rows: Sequence[Row]) -> None:
    """uncertainty.csv, uncertainty_draws.csv and uncertainty_bands.csv."""
    spreads = [spread_row(spread) for spread in bands.spreads]
    if spreads:
        write_table(folder / "uncertainty.csv", spreads, list(spreads[0]))
    for name, of_table in (
        ("uncertainty_draws.csv", list(draw_rows(bands))),
        ("uncertainty_bands.csv", list(band_rows(bands, rows))),
    ):
        write_table(folder / name, of_table, list(of_table[0]))
