"""The record that a benchmark leaves: when, where, and what it found."""

from __future__ import annotations

import os
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import msgspec

from simgl.bench.machine import machine
from simgl.output import complete_file


def load() -> float:
    """Of the machine, mean of the last minute; over 1 other work slows what is timed."""
    return round(os.getloadavg()[0], 1)


def write_record(path: Path, results: msgspec.Struct | Mapping[str, Any]) -> None:
    """Date (UTC) and machine, then what was found, as indented JSON."""
    place = {"date": datetime.now(UTC).date().isoformat(), "machine": machine()}
    record = place | msgspec.to_builtins(results)
    with complete_file(path) as part:
        part.write_bytes(msgspec.json.format(msgspec.json.encode(record), indent=2) + b"\n")
