"""``python -m benchmarks.assess --out DIR``: one orbit assessed at 1,000 epochs of 640 x 480 by two
worker processes, once in one go, and once killed half-way and gone on with; same table or not."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Annotated

import msgspec
import typer

from benchmarks.record import load, write_record
from simgl.output import check_writable
from simgl.sequence.journal import rows_written

SCENARIO = Path(__file__).parent / "orbit.toml"
ORBIT_S = 5553


class Record(msgspec.Struct, frozen=True, kw_only=True):
    """What the last run found.

    load : of the machine before the run
    wall_s : of the run in one go, its report and the start of its processes included
    cpu_ms_per_epoch : of all processes
    same_table : of the run in one go, and of the one that was killed half-way
    """

    epochs: int
    workers: int
    load: float
    wall_s: float
    cpu_ms_per_epoch: float
    same_table: bool


def _command(out: Path, epochs: int, workers: int) -> list[str]:
    options = ["--duration", str(ORBIT_S), "--count", str(epochs), "--workers", str(workers)]
    return [sys.executable, "-m", "simgl", "assess", str(SCENARIO), "--out", str(out), *options]


def main(
    out: Annotated[Path, typer.Option(help="Folder for the reports, and for results.json.")],
    epochs: Annotated[int, typer.Option(help="Instead of 1,000.")] = 1000,
    workers: Annotated[int, typer.Option(help="Processes.")] = 2,
) -> None:
    """Time it, kill it, compare, write results.json."""
    check_writable(out)
    complete, broken = out / "whole", out / "broken"
    before = load()
    start = time.monotonic()
    subprocess.run(_command(complete, epochs, workers), check=True)
    wall = time.monotonic() - start
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(f"{epochs} epochs in {wall:.0f} s")
    running = subprocess.Popen(_command(broken, epochs, workers))
    while running.poll() is None and rows_written(broken) < epochs // 2:
        time.sleep(0.05)
    os.kill(running.pid, signal.SIGKILL)
    running.wait()
    print(f"killed after {rows_written(broken)} epochs")
    subprocess.run(_command(broken, epochs, workers), check=True)
    record = Record(
        epochs=epochs,
        workers=workers,
        load=before,
        wall_s=round(wall, 1),
        cpu_ms_per_epoch=round(1e3 * (used.ru_utime + used.ru_stime) / epochs, 1),
        same_table=(complete / "frames.csv").read_bytes() == (broken / "frames.csv").read_bytes(),
    )
    write_record(out / "results.json", record)
    print(f"{record.cpu_ms_per_epoch} ms of CPU an epoch, same table: {record.same_table}")


if __name__ == "__main__":
    typer.run(main)
