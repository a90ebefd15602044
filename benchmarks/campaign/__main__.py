"""``python -m benchmarks.campaign --out DIR``: the 200 frames of examples/campaign/approach.toml by
one process, by two Dask workers, and by two of which one is killed half-way; same bytes or not."""

from __future__ import annotations

import hashlib
import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Annotated

import msgspec
import psutil
import typer

from benchmarks.record import load, write_record
from simgl.output import check_writable
from simgl.sequence.journal import rows_written

CAMPAIGN = Path(__file__).parents[2] / "examples" / "campaign" / "approach.toml"


class Run(msgspec.Struct, frozen=True, kw_only=True):
    """One way to take all frames.

    wall_s : from the command to its end
    steady_frames_s : frames a second from the tenth one on, when every worker has started
    cpu_s : of all processes
    """

    wall_s: float
    steady_frames_s: float
    cpu_s: float


class Record(msgspec.Struct, frozen=True, kw_only=True):
    """What the last run found.

    load : of the machine before each run
    speed_up : steady rate of two workers over that of one process
    same_bytes : of all files but the database, whoever took the frames
    """

    frames: int
    load: dict[str, float]
    runs: dict[str, Run]
    speed_up: float
    same_bytes: bool


def _workers(pid: int) -> list[psutil.Process]:
    children = psutil.Process(pid).children(recursive=True)
    return [child for child in children if "spawn_main" in " ".join(child.cmdline())]


def _take(campaign: Path, folder: Path, frames: int, workers: int, *, lose_one: bool) -> Run:
    used, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    options = ["--out", str(folder), "--workers", str(workers)]
    running = subprocess.Popen([sys.executable, "-m", "simgl", "campaign", str(campaign), *options])
    tenth = None
    while running.poll() is None:
        done = rows_written(folder)
        if tenth is None and done >= 10:
            tenth = time.monotonic(), done
        if lose_one and done >= frames // 2:
            os.kill(_workers(running.pid)[0].pid, signal.SIGKILL)
            lose_one = False
        if done == frames:
            break
        time.sleep(0.05)
    last = time.monotonic()
    if running.wait() != 0 or tenth is None:
        raise RuntimeError(f"the campaign ended with {running.returncode}")
    now = resource.getrusage(resource.RUSAGE_CHILDREN)
    return Run(
        wall_s=round(time.monotonic() - start, 1),
        steady_frames_s=round((frames - tenth[1]) / (last - tenth[0]), 3),
        cpu_s=round(now.ru_utime + now.ru_stime - used.ru_utime - used.ru_stime, 1),
    )


def _digest(folder: Path) -> str:
    h = hashlib.sha256()
    for path in sorted(folder.rglob("*")):
        if path.is_file() and path.suffix != ".sqlite":
            h.update(str(path.relative_to(folder)).encode() + path.read_bytes())
    return h.hexdigest()


def main(
    out: Annotated[Path, typer.Option(help="Folder for the frames, and for results.json.")],
    frames: Annotated[int, typer.Option(help="Instead of 200.")] = 200,
) -> None:
    """Time them, compare them, write results.json."""
    check_writable(out)
    text = CAMPAIGN.read_text().replace("frames = 200", f"frames = {frames}")
    campaign = out / "campaign.toml"
    campaign.write_text(
        text.replace("../approach.toml", str(CAMPAIGN.parents[1] / "approach.toml"))
    )
    ways = {"one process": (1, False), "two workers": (2, False), "one of two killed": (2, True)}
    loads, runs = {}, {}
    for name, (workers, lose_one) in ways.items():
        loads[name] = load()
        folder = out / name.replace(" ", "_")
        runs[name] = _take(campaign, folder, frames, workers, lose_one=lose_one)
        print(name, runs[name])
    digests = {_digest(out / name.replace(" ", "_")) for name in ways}
    record = Record(
        frames=frames,
        load=loads,
        runs=runs,
        speed_up=round(
            runs["two workers"].steady_frames_s / runs["one process"].steady_frames_s, 2
        ),
        same_bytes=len(digests) == 1,
    )
    write_record(out / "results.json", record)
    print(f"speed-up {record.speed_up}, same bytes: {record.same_bytes}")


if __name__ == "__main__":
    typer.run(main)
