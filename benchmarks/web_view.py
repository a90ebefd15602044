"""What an onlooker costs a served loop: ``python -m benchmarks.web_view [SCENARIO] [--window]``.

A browser that reads the stream of images as fast as it comes, or a follower of previews as
``simgl view --follow`` is one. Short blocks of frames with and without it alternate on one server.
Compared are the time that the client waits for a frame, and the processor time of the server and
its renderer for each. The browser view is a process of its own, whose processor time is told too.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path

from simgl_bridge import Client
from simgl_bridge.processes import end, start_server

_PAIRS, _FRAMES = 24, 10
_STEP_NS = 100_000_000
_BRIDGE, _PAGE, _MONITOR = "tcp://127.0.0.1:5763", "127.0.0.1:5780", "tcp://127.0.0.1:5764"
_READER = """
import sys, urllib.request
stream = urllib.request.urlopen(sys.argv[1])
print(flush=True)
while stream.read(65536): pass
"""
_FOLLOWER = """
import sys
from simgl_bridge import PreviewClient
with PreviewClient(sys.argv[1], timeout_s=600.0) as previews:
    print(flush=True)
    for preview in previews: pass
"""


@dataclass(frozen=True, kw_only=True)
class Block:
    """Medians over the frames of a block [s]: wait of the client; processor time by process."""

    wait: float
    loop: float
    view: float


def processor_seconds(pids: list[int]) -> float:
    """User and system time of processes."""
    ticks = 0
    for pid in pids:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        ticks += int(fields[11]) + int(fields[12])
    return ticks / os.sysconf("SC_CLK_TCK")


def children(pid: int, name: str) -> list[int]:
    """Processes that a process has started, with a word in their command line."""
    started = map(int, Path(f"/proc/{pid}/task/{pid}/children").read_text().split())
    return [p for p in started if name in Path(f"/proc/{p}/cmdline").read_text()]


def measure(scenario: str, arguments: list[str], onlooker: list[str]) -> list[tuple[Block, Block]]:
    """Pairs of blocks, without and with an onlooker.

    arguments : of the server
    onlooker : its command; it prints a line once it looks on. "{camera}" is that of the scenario
    """
    server = start_server([scenario, "--address", _BRIDGE, *arguments], stdout=subprocess.DEVNULL)
    pairs = []
    try:
        with Client(_BRIDGE, timeout_s=300.0) as client:
            now, camera = client.welcome.epoch_tai_ns, client.welcome.cameras[0].name
            loop = [server.pid, *children(server.pid, "render_process")]
            view = children(server.pid, "web_process")

            def block() -> Block:
                nonlocal now
                waits, of_loop, of_view = [], processor_seconds(loop), processor_seconds(view)
                for _ in range(_FRAMES):
                    now += _STEP_NS
                    before = time.perf_counter()
                    client.render(now, camera)
                    waits.append(time.perf_counter() - before)
                return Block(
                    wait=statistics.median(waits),
                    loop=(processor_seconds(loop) - of_loop) / _FRAMES,
                    view=(processor_seconds(view) - of_view) / _FRAMES,
                )

            def watched() -> Block:
                command = [word.format(camera=camera) for word in onlooker]
                with subprocess.Popen(
                    [sys.executable, "-c", *command], stdout=subprocess.PIPE
                ) as process:
                    assert process.stdout is not None
                    process.stdout.readline()
                    try:
                        # What its start costs is over.
                        block()
                        return block()
                    finally:
                        process.kill()

            for pair in range(_PAIRS):
                # The order of the two changes, so that a drift cancels.
                if pair % 2:
                    with_onlooker = watched()
                    block()
                    pairs.append((block(), with_onlooker))
                else:
                    block()
                    pairs.append((block(), watched()))
    finally:
        end(server, 10.0)
    return pairs


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.web_view")
    parser.add_argument("scenario", nargs="?", default="examples/approach.toml")
    parser.add_argument("--window", action="store_true")
    options = parser.parse_args()
    if options.window:
        pairs = measure(options.scenario, ["--monitor", _MONITOR], [_FOLLOWER, _MONITOR])
    else:
        stream = f"http://{_PAGE}/stream/{{camera}}.mjpg"
        pairs = measure(options.scenario, ["--web", "--web-address", _PAGE], [_READER, stream])
    measured: tuple[tuple[str, Callable[[Block], float]], ...] = (
        ("client waits", attrgetter("wait")),
        ("processor time of the loop", attrgetter("loop")),
    )
    for name, of in measured:
        ratios = [of(watched) / of(unwatched) for unwatched, watched in pairs]
        low, middle, high = statistics.quantiles(ratios, n=4)
        unwatched, watched = (
            statistics.median(map(of, blocks)) for blocks in zip(*pairs, strict=True)
        )
        print(
            f"{name}: {1e3 * unwatched:.1f} ms a frame, looked on {1e3 * watched:.1f} ms; "
            f"median ratio of {len(pairs)} pairs {100 * (middle - 1):+.1f} % "
            f"(quartiles {100 * (low - 1):+.1f}, {100 * (high - 1):+.1f})"
        )
    view = statistics.median(watched.view for _, watched in pairs)
    print(f"processor time of the browser view: {1e3 * view:.1f} ms a frame")


if __name__ == "__main__":
    main()
