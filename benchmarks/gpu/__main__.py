"""simgl on the GPU of this machine, in ten minutes at most: a JSON record and the tests' log.

python -m benchmarks.gpu --wheels DIR --out DIR

Needs Python 3.11 or later, a folder of wheels (simgl's, and those of the packages that this Python
lacks) and the GPU driver's EGL library; no network and no display. Starts with the standard
library alone, since the wheels are unpacked first.

wheels : pip download --only-binary=:all: --python-version 3.12 -d DIR PACKAGE...
out : gets gpu.json, bench.json, the page report/index.html, doctor.txt, ways.txt and tests.txt

The tests run first, and beside them each scene once, which fills the caches; then the scenes alone;
last what a GPU may leave to the CPU, both ways (``benchmarks.gpu.ways``).
"""

from __future__ import annotations

import argparse
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# Whatever draws; the other tests do not know a GPU from a CPU.
TESTS = ("tests/passes", "tests/gpu", "tests/radiometry", "tests/simulator", "tests/reference")
# The set "gpu" of simgl bench, which cannot be imported before the wheels are unpacked.
SCENES = (
    *("source_600", "earth_1280", "camera_1280", "bay_1280", "square_2048", "reference_1280"),
    *("four_cameras", "docking_20m", "docking_3m"),
)
# Of each step [s]; together ten minutes.
LIMITS_S = {
    "unpack": 60.0,
    "doctor": 30.0,
    "fill": 180.0,
    "bench": 210.0,
    "ways": 120.0,
    "tests": 180.0,
}


def _unpack(wheels: Path, site: Path) -> None:
    """Put the wheels into a folder of their own, as they are: pip resolves nothing."""
    files = sorted(str(path) for path in wheels.glob("*.whl"))
    if not files:
        sys.exit(f"{wheels}: holds no wheels")
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--no-index", "--no-deps"]
    subprocess.run(
        [*command, "--target", str(site), *files], check=True, timeout=LIMITS_S["unpack"]
    )


class _Steps:
    """Runs one step after another with the unpacked packages and caches of their own."""

    def __init__(self, out: Path, site: Path, caches: Path) -> None:
        self._out = out
        paths = (ROOT, ROOT / "bridge", site)
        self._environment = os.environ | {
            "PYTHONPATH": os.pathsep.join(map(str, paths)),
            "XDG_CACHE_HOME": str(caches.resolve()),
        }

    def run(self, name: str, *arguments: str) -> tuple[str, float | None]:
        """Output, which also goes to NAME.txt, and seconds: None past the limit, which ends it.

        The limit is that of the first word of the name.
        """
        command = [sys.executable, *arguments]
        limit = LIMITS_S[name.partition("_")[0]]
        start = time.perf_counter()
        seconds = None
        with (self._out / f"{name}.txt").open("w+") as log:
            process = subprocess.Popen(
                command,
                cwd=ROOT,
                env=self._environment,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
            try:
                process.wait(limit)
                seconds = round(time.perf_counter() - start, 2)
            except subprocess.TimeoutExpired:
                # With the processes that it has started.
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
                log.write(f"\nended after {limit:.0f} s\n")
            log.seek(0)
            return log.read(), seconds


def _driver() -> str:
    """Name and driver version of the GPU as NVIDIA's tool gives them; empty without it."""
    query = ["nvidia-smi", "--query-gpu=name,driver_version", "--format=csv,noheader"]
    try:
        return subprocess.run(query, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""


def _counts(log: str) -> dict[str, int]:
    """Tests by outcome, from the last line that pytest writes."""
    summary = [line for line in log.splitlines() if " in " in line and "passed" in line]
    last = summary[-1] if summary else ""
    return {word: int(n) for n, word in re.findall(r"(\d+) (passed|failed|skipped)", last)}


def _failures(log: str) -> list[str]:
    """Tests that failed, each once."""
    return sorted(set(re.findall(r"^(?:FAILED|ERROR) (\S+)", log, re.MULTILINE)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, add_help=True)
    parser.add_argument("--wheels", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--frames", type=int, default=100, help="timed frames of each scene")
    parser.add_argument("--scene", action="append", default=[], help="only these scenes")
    parser.add_argument("--tests", nargs="*", default=TESTS, help="folders or files of tests")
    parser.add_argument("--caches", type=Path, help="folder of caches that stay; else none stay")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    out = options.out.resolve()
    with tempfile.TemporaryDirectory() as temporary:
        site, caches = Path(temporary, "site"), options.caches or Path(temporary, "caches")
        _unpack(options.wheels, site)
        steps = _Steps(out, site, caches)
        doctor, _ = steps.run("doctor", "-m", "simgl", "doctor")
        tests, tests_s = _tests_alongside_scenes(steps, options)
        bench, bench_s = steps.run("bench", "-m", "simgl", "bench", *_bench_options(options, out))
        ways, _ = steps.run("ways", "-m", "benchmarks.gpu.ways")
        results = out / "bench.json"
        record = {
            "date": datetime.now(UTC).date().isoformat(),
            "gpu": _driver(),
            "python": sys.version.split()[0],
            "doctor": doctor.splitlines(),
            "bench": json.loads(results.read_bytes()) if results.exists() else bench,
            "bench_s": bench_s,
            "ways": _json_lines(ways),
            "tests": {**_counts(tests), "seconds": tests_s, "failures": _failures(tests)},
        }
        (out / "gpu.json").write_text(json.dumps(record, indent=2) + "\n")
        print(doctor, bench, ways, json.dumps(record["tests"]), sep="\n")


def _json_lines(log: str) -> dict[str, object]:
    """What a step printed as lines of JSON objects, together; other lines are left out."""
    lines = (line for line in log.splitlines() if line.startswith("{"))
    return {name: value for line in lines for name, value in json.loads(line).items()}


def _tests_alongside_scenes(steps: _Steps, options: argparse.Namespace) -> tuple[str, float | None]:
    """Log of the tests and their seconds; the caches then have what the scenes need."""
    workers = str(min(8, os.cpu_count() or 1))
    # A package that the wheels lack fails the tests that need it, and no others.
    going_on = ("--continue-on-collection-errors", "-o", "filterwarnings=default")
    pytest = ("-m", "pytest", "-q", "-n", workers, "-p", "no:cacheprovider", *going_on)
    scenes = options.scene or SCENES
    with ThreadPoolExecutor(len(scenes) + 1) as executor:
        tests = executor.submit(steps.run, "tests", *pytest, *options.tests)
        for scene in scenes:
            executor.submit(steps.run, f"fill_{scene}", *_once(scene))
    return tests.result()


def _once(scene: str) -> tuple[str, ...]:
    return ("-m", "simgl", "bench", "--scene", scene, "--frames", "5", "--seconds", "1")


def _bench_options(options: argparse.Namespace, out: Path) -> list[str]:
    chosen = [word for scene in options.scene for word in ("--scene", scene)] or ["--set", "gpu"]
    if options.scene:
        chosen += ["--step", "0.1"]
    frames = ["--frames", str(options.frames)]
    return [*chosen, *frames, "--json", str(out / "bench.json"), "--report", str(out / "report")]


if __name__ == "__main__":
    main()
