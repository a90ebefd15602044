"""Damage files of every kind; count how they end: loaded and drawn, refused in one line, or not.

``python -m benchmarks.damaged_files --count 500`` takes some minutes. Each file is read by a
process of its own, with limits on time and memory; what loads is drawn too. Any other end than
success or one error of simgl counts as a failure, is printed with its seed and kept in ``--keep``.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from benchmarks.damaged_files.damages import damage_one
from benchmarks.damaged_files.valid_files import READERS, check_valid, write_all
from simgl import SimglError
from simgl.scenario.loader import scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.state import SceneState
from simgl.simulator import Simulator

# Of one file: a wait never ends by itself; of the processor a machine under load takes no more.
SECONDS, CPU_SECONDS = 300.0, 60
MEMORY = 8 << 30


@dataclass(frozen=True, kw_only=True)
class Ending:
    """How the reading of one file ended.

    kind : "loaded", "refused", "crashed", "hung" or "killed"
    """

    kind: str
    text: str


def attempt(work: Callable[[], str], seconds: float = SECONDS, memory: int = MEMORY) -> Ending:
    """The ending of some work in a process of its own, which may end in any way."""
    read_end, write_end = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(read_end)
        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS, CPU_SECONDS))
        text = _ending_of(work)
        os.write(write_end, text.encode(errors="backslashreplace")[:60_000])
        os._exit(0)
    os.close(write_end)
    end = time.monotonic() + seconds
    while (done := os.waitpid(child, os.WNOHANG))[0] == 0:
        if time.monotonic() > end:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            os.close(read_end)
            return Ending(kind="hung", text=f"no end within {seconds:.0f} s")
        time.sleep(0.005)
    with os.fdopen(read_end, "rb") as pipe:
        kind, _, text = pipe.read().decode().partition("\n")
    if not kind:
        return Ending(kind="killed", text=f"status {done[1]}")
    return Ending(kind=kind, text=text)


def _ending_of(work: Callable[[], str]) -> str:
    """Kind and text of an ending in this process."""
    try:
        return f"loaded\n{work()}"
    except SimglError as error:
        message = str(error)
        if "\n" in message or not message or len(message) > 5000:
            return f"crashed\nno single short line: {message[:3000]}"
        return f"refused\n{message}"
    except BaseException:
        return f"crashed\n{traceback.format_exc()[-4000:]}"


def read_and_drawn(name: str, folder: Path) -> str:
    """What a file is read as; a scenario or a model is drawn."""
    read = READERS[name](folder)
    if isinstance(read, SpacecraftModel):
        read = scenario_of(read)
    if not isinstance(read, Scenario):
        return type(read).__name__
    with Simulator(read) as simulator:
        state = _small(read.at(read.epoch_tai_ns))
        capture = simulator.capture(state, next(iter(read.cameras)))
    assert capture.digital is not None
    return f"drawn, mean {capture.digital.dn.mean():.1f} DN"


def _small(state: SceneState) -> SceneState:
    """The scene with images that are drawn in a moment, whatever size the file asks for."""
    cameras = {}
    for name, placed in state.cameras.items():
        detector = placed.camera.detector
        size = min(detector.width, 48), min(detector.height, 32)
        detector = replace(detector, width=size[0], height=size[1])
        cameras[name] = replace(placed, camera=replace(placed.camera, detector=detector))
    return replace(state, cameras=cameras)


def scenario_of(model: SpacecraftModel) -> Scenario:
    """A model alone in the sunlight."""
    size = max(float(model.mesh.radius), 1e-3)
    data = {
        "epoch": {"utc": "2026-03-20T12:00:00"},
        "earth": {"shape": "none"},
        "spacecraft": {"one": {"model": "wedge", "position_icrf_m": [7e6, 0.0, 0.0]}},
        "camera": {
            "cam": {
                "position_icrf_m": [7e6 + 5.0 * size, 3.0 * size, 0.0],
                "look_at": "one",
                "up": [0.0, 0.0, 1.0],
                "axes": "icrf",
                "width_px": 32,
                "height_px": 24,
                "exposure_time_s": 1e-5,
            }
        },
    }
    return scenario_from_dict(data, models={"one": model})


def main() -> int:
    """Run it; 1 if any file ended otherwise than loaded or refused."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=500)
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="folder for files that end badly")
    parser.add_argument("--verbose", action="store_true", help="print every ending")
    parser.add_argument("--out", type=Path, help="write the numbers to this JSON file")
    options = parser.parse_args()
    endings: Counter[str] = Counter()
    by_file: dict[str, Counter[str]] = {name: Counter() for name in READERS}
    began, longest = time.monotonic(), 0.0
    caches = tempfile.TemporaryDirectory()
    os.environ["XDG_CACHE_HOME"] = caches.name
    with tempfile.TemporaryDirectory() as valid:
        write_all(Path(valid))
        check_valid(Path(valid))
    for number in range(options.first, options.first + options.count):
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            write_all(folder)
            name, what = damage_one(number, options.seed, folder)
            start = time.monotonic()
            ending = attempt(partial(read_and_drawn, name, folder))
            longest = max(longest, time.monotonic() - start)
            endings[ending.kind] += 1
            by_file[name][ending.kind] += 1
            if options.verbose or ending.kind not in ("loaded", "refused"):
                print(f"{what}: {ending.kind}: {ending.text}", flush=True)
                if options.keep is not None and ending.kind not in ("loaded", "refused"):
                    options.keep.mkdir(parents=True, exist_ok=True)
                    (options.keep / f"{options.seed}-{number}-{name}").write_bytes(
                        (folder / name).read_bytes()
                    )
    result = {
        "tried": options.count,
        **{kind: endings[kind] for kind in ("refused", "loaded", "crashed", "hung", "killed")},
        "seed": options.seed,
        "minutes": round((time.monotonic() - began) / 60.0, 1),
        "longest_s": round(longest, 1),
        "by_file": {name: dict(counts) for name, counts in by_file.items()},
    }
    caches.cleanup()
    print(json.dumps(result, indent=1))
    if options.out is not None:
        options.out.write_text(json.dumps(result, indent=1) + "\n")
    return int(endings["refused"] + endings["loaded"] != options.count)


if __name__ == "__main__":
    sys.exit(main())
