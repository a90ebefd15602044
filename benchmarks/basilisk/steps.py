"""``python -m benchmarks.basilisk.steps``: very many steps of liveStream; is the memory flat?

Every step sends a state and asks for input, one in a hundred for an image, as Basilisk does; the
result goes to ``steps.json`` beside this file. ``--steps 2000`` is a short form.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.bridge.scene import machine, resident_kib
from tests.bridge import basilisk_wire as wire

RESULT = Path(__file__).parent / "steps.json"
IMAGE_EVERY = 100
# Growth after the first fifth that is still called flat [percent].
FLAT = 1.0


def steps(count: int, folder: Path) -> dict[str, object]:
    """Run ``count`` steps; raises AssertionError at a reply that would end Basilisk's run."""
    (folder / "base.toml").write_text(wire.SCENARIO)
    (folder / "navcam.toml").write_text(wire.SHEET)
    address = f"ipc://{folder / 'source'}"
    command = [sys.executable, "-m", "simgl_bridge.commands", str(folder / "base.toml")]
    command += ["--basilisk", address, "--camera", f"1={folder / 'navcam.toml'}"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    try:
        peer = wire.Peer(address)
        assert peer.ask(b"PING") == [b"PONG"]
        before = 0
        began = time.perf_counter()
        for step in range(1, count + 1):
            assert peer.update(wire.scene(seconds=0.1 * step, frame=step)) == [b"OK"]
            assert peer.ask(b"REQUEST_INPUT")[0] == b"VIZARD_INPUT"
            if step % IMAGE_EVERY == 0:
                assert peer.image()
            if step == count // 5:
                before = resident_kib(process.pid)
        seconds = time.perf_counter() - began
        after = resident_kib(process.pid)
        peer.close()
    finally:
        process.terminate()
        process.wait(20)
    return {
        **machine(),
        "steps": count,
        "images": count // IMAGE_EVERY,
        "seconds": round(seconds, 1),
        "server_kib": [before, after],
        "server_growth_percent": round(100.0 * (after / before - 1.0), 3),
    }


def main() -> int:
    """Run, print, keep; 1 where memory grew."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.basilisk.steps")
    parser.add_argument("--steps", type=int, default=100_000)
    parser.add_argument("--out", type=Path, help=f"a file for the result, such as {RESULT}")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        result = steps(options.steps, Path(folder))
    print(json.dumps(result, indent=2))
    if options.out:
        options.out.write_text(json.dumps(result, indent=2) + "\n")
    growth = result["server_growth_percent"]
    assert isinstance(growth, float)
    return int(growth > FLAT)


if __name__ == "__main__":
    sys.exit(main())
