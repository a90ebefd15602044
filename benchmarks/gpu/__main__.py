"""simgl on the GPU of this machine, in about five minutes: a JSON record and the tests' log.

python -m benchmarks.gpu --wheels DIR --out DIR

Needs Python 3.11 or later, a folder of wheels (simgl's, and those of the packages that this Python
lacks) and the GPU driver's EGL library; no network and no display. Starts with the standard
library alone, since the wheels are unpacked first.

wheels : pip download --only-binary=:all: --python-version 3.12 -d DIR PACKAGE...
out : gets gpu.json, bench.json, doctor.txt and tests.txt
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from datetime import UTC, datetime
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# Whatever draws; the other tests do not know a GPU from a CPU.
TESTS = ("tests/passes", "tests/gpu", "tests/radiometry", "tests/simulator", "tests/reference")
# Of each step [s].
LIMIT = 200.0
# Of simulated time between frames: an orbit sampled every second, and a loop of 10 Hz.
STEPS_S = (1.0, 0.1)
FIRST_FRAME = (
    "import simgl\n"
    "scenario = simgl.load_scenario('simgl/data/bench/source_600.toml')\n"
    "with simgl.Simulator(scenario) as simulator:\n"
    "    simulator.capture(scenario.at(scenario.epoch_tai_ns), 'observer')\n"
)


def _unpack(wheels: Path, site: Path) -> None:
    """Put the wheels into a folder of their own, as they are: pip resolves nothing."""
    files = sorted(str(path) for path in wheels.glob("*.whl"))
    if not files:
        sys.exit(f"{wheels}: holds no wheels")
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--no-index", "--no-deps"]
    subprocess.run([*command, "--target", str(site), *files], check=True, timeout=LIMIT)


class _Steps:
    """Runs one step after another with the unpacked packages and caches of their own."""

    def __init__(self, out: Path, site: Path, caches: Path) -> None:
        self._out = out
        paths = (ROOT, ROOT / "bridge", site)
        self._environment = os.environ | {
            "PYTHONPATH": os.pathsep.join(map(str, paths)),
            "XDG_CACHE_HOME": str(caches),
        }

    def run(self, name: str, *arguments: str) -> tuple[str, float | None]:
        """Output, which also goes to NAME.txt, and seconds: None past the limit, which ends it."""
        command = [sys.executable, *arguments]
        start = time.perf_counter()
        seconds = None
        with (self._out / f"{name}.txt").open("w+") as log:
            try:
                subprocess.run(
                    command,
                    cwd=ROOT,
                    env=self._environment,
                    stdout=log,
                    stderr=subprocess.STDOUT,
                    timeout=LIMIT,
                    check=False,
                )
                seconds = round(time.perf_counter() - start, 2)
            except subprocess.TimeoutExpired:
                log.write(f"\nended after {LIMIT:.0f} s\n")
            log.seek(0)
            return log.read(), seconds

    def bench(self, step_s: float) -> object:
        """Scenes of ``simgl bench`` with frames so far apart; None where it failed."""
        path = self._out / f"bench-{step_s:g}s.json"
        arguments = ("--frames", "60", "--step", f"{step_s:g}", "--json", str(path))
        self.run(f"bench-{step_s:g}s", "-m", "simgl", "bench", *arguments)
        return json.loads(path.read_bytes())["scenes"] if path.exists() else None


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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, add_help=True)
    parser.add_argument("--wheels", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        site, caches = Path(temporary, "site"), Path(temporary, "caches")
        _unpack(options.wheels, site)
        steps = _Steps(options.out, site, caches)
        doctor, _ = steps.run("doctor", "-m", "simgl", "doctor")
        starts = [steps.run("start", "-c", FIRST_FRAME)[1] for _ in range(3)]
        scenes = {f"{step_s:g}": steps.bench(step_s) for step_s in STEPS_S}
        workers = str(min(8, os.cpu_count() or 1))
        pytest = ("-m", "pytest", "-q", "-n", workers, "-p", "no:cacheprovider")
        tests, seconds = steps.run("tests", *pytest, "-o", "filterwarnings=default", *TESTS)
        record = {
            "date": datetime.now(UTC).date().isoformat(),
            "gpu": _driver(),
            "doctor": doctor.splitlines(),
            "start_s": {"cold caches": starts[0], "warm caches": starts[1:]},
            "scenes_by_step_s": scenes,
            "tests": {**_counts(tests), "seconds": seconds},
        }
        (options.out / "gpu.json").write_text(json.dumps(record, indent=2) + "\n")
        print(json.dumps({key: record[key] for key in ("gpu", "start_s", "tests")}, indent=2))


if __name__ == "__main__":
    main()
