"""``python -m benchmarks.bridge``: the long proofs, their results as JSON.

    overhead  round trips without rendering, by size and transport
    fuzz      mutated messages against a live server that records
    loop      checked frames without rendering
    soak      checked frames, rendered


python -m benchmarks.bridge                      100,000 frames, 100,000 mutated messages
python -m benchmarks.bridge --short              1,000 of each, 250 rendered: what CI runs
python -m benchmarks.bridge --only soak --frames 5000
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path

from benchmarks.bridge.fuzz import fuzz
from benchmarks.bridge.overhead import overhead
from benchmarks.bridge.soak import loop, soak

RESULTS = Path(__file__).parent / "results.json"
RUNS = {"overhead": overhead, "fuzz": fuzz, "loop": loop, "soak": soak}
LONG = {"overhead": 2000, "fuzz": 100_000, "loop": 100_000, "soak": 100_000}
SHORT = {"overhead": 100, "fuzz": 1000, "loop": 1000, "soak": 250}
# Growth after warm-up that is still called flat [percent].
FLAT = 1.0


def main() -> int:
    """Run what is asked for; 1 where memory grew."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.bridge")
    parser.add_argument("--short", action="store_true", help="what CI runs")
    parser.add_argument("--only", choices=sorted(RUNS), help="one of the runs")
    parser.add_argument("--frames", type=int, help="instead of the usual number")
    parser.add_argument("--out", type=Path, help=f"add the results to a file, such as {RESULTS}")
    options = parser.parse_args()
    counts = SHORT if options.short else LONG
    failed = False
    for name in [options.only] if options.only else list(RUNS):
        with tempfile.TemporaryDirectory() as folder:
            result = RUNS[name](options.frames or counts[name], Path(folder))
        print(json.dumps({name: result}, indent=2), flush=True)
        growth = [v for k, v in result.items() if k.endswith("growth_percent")]
        failed |= not options.short and any(g > FLAT for g in growth)  # type: ignore[operator]
        if options.out:
            known = json.loads(options.out.read_text()) if options.out.exists() else {}
            options.out.write_text(json.dumps({**known, name: result}, indent=2) + "\n")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
