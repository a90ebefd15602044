"""``python -m benchmarks.truth --out DIR``: truth.json, and the page docs/truth.md made of it."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import moderngl
import msgspec
import typer
from rich.console import Console

from benchmarks.record import write_record
from benchmarks.truth import (
    between_spacecraft,
    body_light,
    cubesat,
    earth_light,
    geometry,
    glossy,
    highlights,
    lamps,
    moonlight,
    moving,
    mtf,
    small_targets,
    thermal,
    thin_shadows,
)
from benchmarks.truth.page import Record, merged_tables, page
from benchmarks.truth.rows import Table
from simgl.gpu.context import temporary_context
from simgl.output import check_writable, complete_file

_SUBJECTS: dict[str, Callable[[moderngl.Context], Table]] = {
    "highlights": highlights.table,
    "small_targets": small_targets.table,
    "earth_light": earth_light.table,
    "moonlight": moonlight.table,
    "lamps": lamps.table,
    "thin_shadows": thin_shadows.table,
    "body_light": body_light.table,
    "between_spacecraft": between_spacecraft.table,
    "glossy": glossy.table,
    "mtf": mtf.table,
    "geometry": geometry.table,
    "moving": moving.table,
    "thermal": thermal.table,
    "thermal_radiation": thermal.radiation,
    "cubesat": cubesat.table,
}


class _Run(msgspec.Struct, frozen=True, kw_only=True):
    minutes: float
    tables: list[Table]


def main(
    out: Annotated[Path, typer.Option(help="Folder for truth.json and truth.md.")],
    subject: Annotated[list[str] | None, typer.Option(help="Only these subjects.")] = None,
    earlier_record: Annotated[
        Path | None, typer.Option(help="A truth.json whose other tables stay.")
    ] = None,
) -> None:
    """Compare simgl with the truth, subject by subject."""
    check_writable(out)
    earlier = (
        None
        if earlier_record is None
        else msgspec.json.decode(earlier_record.read_bytes(), type=Record)
    )
    unknown = set(subject or ()) - set(_SUBJECTS)
    if unknown:
        known = ", ".join(_SUBJECTS)
        raise typer.BadParameter(f"--subject {min(unknown)}: allowed are {known}")
    console, start, tables = Console(), time.monotonic(), []
    for name in subject or list(_SUBJECTS):
        with temporary_context() as gl:
            table = _SUBJECTS[name](gl)
        tables.append(table)
        missed = [row for row in table.rows if not row.met]
        console.print(f"{name}: {len(table.rows) - len(missed)} of {len(table.rows)} goals met")
        for row in missed:
            console.print(f"  {row.case}: error {row.error:+.3g}, goal {row.goal:g}")
    minutes = (time.monotonic() - start) / 60.0
    tables = tables if earlier is None else merged_tables(earlier, tables)
    write_record(out / "truth.json", _Run(minutes=minutes, tables=tables))
    record = msgspec.json.decode((out / "truth.json").read_bytes(), type=Record)
    with complete_file(out / "truth.md") as part:
        part.write_text(page(record))


if __name__ == "__main__":
    typer.run(main)
