"""The table of a run: one row per frame, written when the frame's files are complete.

It is an SQLite database, so that a run that is interrupted at any instant leaves complete rows only
and can be resumed. Any tool can read its table ``frames``.
"""

from __future__ import annotations

import csv
import json
import sqlite3
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from simgl.errors import ConfigError, OutputError
from simgl.interruption import unfinished_files
from simgl.output import complete_file
from simgl.progress import ProgressCallback, silent
from simgl.workers.frame_job import Executor, T

Value = str | int | float | None
# What identifies a run, by name: a value, or the parts of something with the digest of each.
Identity = Mapping[str, Value | Mapping[str, str]]
Row = dict[str, Value]
ColumnType = type[str] | type[int] | type[float]
# Name to type, the key columns first.
Columns = Mapping[str, ColumnType]
_TYPES = {str: "TEXT", int: "INTEGER", float: "REAL"}


def rows_written(folder: Path) -> int:
    """Rows in a folder's journal, also while another process writes it; 0 where there is none."""
    try:
        with sqlite3.connect(f"file:{folder / 'frames.sqlite'}?mode=ro", uri=True) as database:
            (count,) = database.execute("SELECT count(*) FROM frames").fetchone()
    except sqlite3.OperationalError:
        return 0
    return int(count)


class Journal:
    """Rows of a run in ``folder/frames.sqlite``.

    plan : what identifies the run; a folder that holds another one is refused
    columns : name to type, the key columns first
    keys : how many columns identify a row
    Raises ConfigError for another run's folder, OutputError where it cannot be written.
    """

    def __init__(
        self,
        folder: Path,
        plan: Identity,
        columns: Columns,
        keys: int,
    ) -> None:
        self.path = folder / "frames.sqlite"
        self._columns, self._keys = tuple(columns), keys
        try:
            self._database = sqlite3.connect(self.path, isolation_level=None)
            self._begin(plan, columns)
        except sqlite3.DatabaseError as error:
            raise OutputError(f"{self.path}: cannot be used ({error})") from None

    def _begin(self, plan: Identity, columns: Columns) -> None:
        fields = ", ".join(f'"{name}" {_TYPES[kind]}' for name, kind in columns.items())
        names = ", ".join(f'"{name}"' for name in self._columns[: self._keys])
        with self._database:
            self._database.execute("BEGIN IMMEDIATE")
            self._database.execute("CREATE TABLE IF NOT EXISTS plan (name TEXT PRIMARY KEY, value)")
            stored = dict(self._database.execute("SELECT name, value FROM plan").fetchall())
            if not stored:
                self._database.execute(f"CREATE TABLE frames ({fields}, PRIMARY KEY ({names}))")
                self._database.executemany(
                    "INSERT INTO plan VALUES (?, ?)", [(n, json.dumps(v)) for n, v in plan.items()]
                )
                # A run that ends before its first row leaves no folder that belongs to it.
                unfinished_files.add(self.path)
                return
        before = {name: json.loads(value) for name, value in stored.items()}
        for name in {**plan, **before}:
            if plan.get(name) != before.get(name):
                self._database.close()
                difference = _difference(before.get(name), plan.get(name))
                problem = (
                    f"holds another run: {name} {difference}; "
                    "take another folder or remove it to start again"
                )
                raise ConfigError(str(self.path), "", problem)

    def done(self) -> set[tuple[Value, ...]]:
        """The keys of all rows."""
        names = ", ".join(f'"{name}"' for name in self._columns[: self._keys])
        return set(self._database.execute(f"SELECT {names} FROM frames").fetchall())

    def add(self, row: Mapping[str, Value]) -> None:
        """Commit one row; a row of the same key is replaced."""
        values = [row[name] for name in self._columns]
        places = ", ".join("?" * len(values))
        try:
            self._database.execute(f"INSERT OR REPLACE INTO frames VALUES ({places})", values)
        except sqlite3.DatabaseError as error:
            raise OutputError(f"{self.path}: cannot be written ({error})") from None
        unfinished_files.discard(self.path)

    def rows(self) -> Iterable[Row]:
        """All rows in order of their keys."""
        order = ", ".join(f'"{name}"' for name in self._columns[: self._keys])
        names = ", ".join(f'"{name}"' for name in self._columns)
        for row in self._database.execute(f"SELECT {names} FROM frames ORDER BY {order}"):
            yield dict(zip(self._columns, row, strict=True))

    def export(self, path: Path) -> None:
        """All rows as comma-separated values, with a header."""
        with complete_file(path) as temporary, temporary.open("w", newline="") as file:
            writer = csv.DictWriter(file, self._columns)
            writer.writeheader()
            writer.writerows(self.rows())

    def close(self) -> None:
        """Close the file."""
        self._database.close()

    def __enter__(self) -> Journal:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _difference(before: Any, now: Any) -> str:
    """What has changed between two values of a plan."""
    if isinstance(before, dict) and isinstance(now, dict):
        for part in now | before:
            if part not in now:
                return f"has changed: {part} is not part of it now"
            if part not in before:
                return f"has changed: {part} was not part of it"
            if before[part] != now[part]:
                return f"has changed: {part} is not the same"
    if isinstance(before, dict) or isinstance(now, dict):
        return "is of another version of simgl"
    was, now_is = ("not given" if v is None else json.dumps(v) for v in (before, now))
    return f"was {was}, now {now_is}"


def run_missing(
    missing: Sequence[int],
    total: int,
    executor: Executor[T],
    store: Callable[[T], None],
    progress: ProgressCallback = silent,
) -> None:
    """Execute the frames that have no row yet, and store each result as it arrives.

    total : frames of the run, complete ones included
    progress : receives the frames complete and their total number
    """
    progress(total - len(missing), total)
    if missing:
        with executor as execute:
            for done, result in enumerate(execute(missing), start=total - len(missing) + 1):
                store(result)
                progress(done, total)
