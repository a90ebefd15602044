"""A short campaign again and again, with allocators that make damage to the heap show.

python -m benchmarks.campaign.crash_hunt --runs 200 --out FILE.json

Each run starts two Dask workers and ends them. Freed and new memory is filled with a pattern
(MALLOC_PERTURB_), Python uses the C library's allocator, and faulthandler writes what a worker did
when it died. Counts runs that failed, workers that died, and runs whose files differ in a byte.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import msgspec

from benchmarks.record import write_record
from tests.campaign.small import LIT_BY_LAMP

# A body that sees itself, so that traced light is read from the cache, and a lamp.
_SCENE = LIT_BY_LAMP.replace("wedge", "cubesat_12u")
_CAMPAIGN = """\
scenario = "scene.toml"
frames = 8
seed = 5
[draw]
range_m = { log_uniform = [1.5, 12.0] }
direction = "sphere"
attitude = "uniform"
"""
_CHECKS = {
    "PYTHONFAULTHANDLER": "1",
    "PYTHONMALLOC": "malloc",
    "MALLOC_TRIM_THRESHOLD_": "65536",
    "MALLOC_PERTURB_": "165",
}
_SIGNS = ("Fatal Python error", "Segmentation fault", "corrupted", "double free", "core dumped")
_LIMIT_S = 600.0


class Record(msgspec.Struct, frozen=True, kw_only=True):
    """What all runs found.

    lost : runs with a sign of a dead process, or that did not end well
    differing : runs whose files are not those of the first
    signs : the lines that told so
    """

    runs: int
    lost: int
    differing: int
    minutes: float
    signs: list[str]


def _digest(folder: Path) -> str:
    """Of all images and labels."""
    h = hashlib.sha256()
    for path in sorted(folder.rglob("*")):
        if path.suffix in {".png", ".exr", ".json", ".csv"}:
            h.update(path.relative_to(folder).as_posix().encode() + path.read_bytes())
    return h.hexdigest()


def _run(campaign: Path, out: Path) -> tuple[bool, list[str]]:
    """Whether it ended well, and the lines that tell of a crash."""
    command = [sys.executable, "-m", "simgl", "campaign", str(campaign), "--workers", "2"]
    done = subprocess.run(
        [*command, "--out", str(out)],
        env=os.environ | _CHECKS,
        capture_output=True,
        text=True,
        timeout=_LIMIT_S,
        check=False,
    )
    signs = [line for line in done.stderr.splitlines() if any(sign in line for sign in _SIGNS)]
    return done.returncode == 0 and not signs, signs or done.stderr.splitlines()[-12:]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    start, lost, differing, signs = time.monotonic(), 0, 0, list[str]()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        (folder / "scene.toml").write_text(_SCENE)
        (folder / "campaign.toml").write_text(_CAMPAIGN)
        first = ""
        for run in range(options.runs):
            out = folder / f"run_{run}"
            well, lines = _run(folder / "campaign.toml", out)
            digest = _digest(out)
            first = first or digest
            if not well:
                lost += 1
                signs += lines
            differing += digest != first
            record = Record(
                runs=run + 1,
                lost=lost,
                differing=differing,
                minutes=round((time.monotonic() - start) / 60.0, 1),
                signs=signs[:20],
            )
            write_record(options.out, record)
    print(f"{record.runs} runs, {record.lost} lost, {record.differing} with other files")


if __name__ == "__main__":
    main()
