"""The page of truth tables, from the record of a run."""

from __future__ import annotations

import msgspec

from benchmarks.truth.rows import Row, Table

HEAD = """# Truth tables

Cases with a known answer: the truth, the result of simgl, the error and its goal. Rows that miss
their goal stay in the table. Made by `python -m benchmarks.truth --out DIR`; a table from another
run names that run. All other measurements: [verification](verification.md).
"""


class Record(msgspec.Struct, frozen=True, kw_only=True):
    """A run: when and where, and its tables.

    minutes : that it took
    """

    date: str
    machine: str
    minutes: float
    tables: list[Table]


def merged_tables(earlier: Record, tables: list[Table]) -> list[Table]:
    """The tables of a record, with new ones in the place of those of the same title, or behind."""
    run = f"{earlier.date} on {earlier.machine}"
    new = {table.title: table for table in tables}
    merged = [
        new.pop(table.title, msgspec.structs.replace(table, made=table.made or run))
        for table in earlier.tables
    ]
    return [*merged, *new.values()]


def _number(value: float) -> str:
    return f"{value:.4g}"


def _line(row: Row) -> str:
    met = "yes" if row.met else f"no, {row.share:.2f} times"
    cells = (
        row.case,
        _number(row.truth),
        _number(row.simgl),
        f"{row.error:+.2g}",
        _number(row.goal),
        met,
    )
    return "| " + " | ".join(cells) + " |"


def page(record: Record, head: str = HEAD) -> str:
    """As Markdown; head : its title and what it is about."""
    rows = [row for table in record.tables for row in table.rows]
    met = sum(row.met for row in rows)
    parts = [
        head,
        f"Run of {record.date}, {record.minutes:.0f} minutes on {record.machine}: "
        f"{met} of {len(rows)} rows meet their goal.\n",
    ]
    for table in record.tables:
        lines = [_line(row) for row in table.rows]
        parts.append(
            f"## {table.title}\n\nTruth: {table.reference}. Quantity: {table.quantity}. "
            f"Error: {table.error}.{f' Run of {table.made}.' if table.made else ''}\n\n"
            "| case | truth | simgl | error | goal | met |\n|---|---|---|---|---|---|\n"
            + "\n".join(lines)
            + "\n"
        )
    return "\n".join(parts)
