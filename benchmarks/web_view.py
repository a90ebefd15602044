"""What a browser that looks on costs a served loop: ``python -m benchmarks.web_view [SCENARIO]``.

Blocks of frames with one viewer and without any alternate, on one server. Compared are the time
that the client waits for a frame, and the processor time of the server and its renderer for each.
The viewer reads the stream of images as fast as it comes; it and the view's encoder are processes
of their own, so that on few cores they may also slow a loop by taking turns with it.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

from simgl_bridge import Client
from simgl_bridge.processes import end, start_server

_PAIRS, _FRAMES = 12, 20
_STEP_NS = 100_000_000
_READER = "import sys, urllib.request as u\nr = u.urlopen(sys.argv[1])\nwhile r.read(65536): pass"


def processor_seconds(pids: list[int]) -> float:
    """User and system time of processes."""
    ticks = 0
    for pid in pids:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        ticks += int(fields[11]) + int(fields[12])
    return ticks / os.sysconf("SC_CLK_TCK")


def loop_processes(server: int) -> list[int]:
    """The server and its renderer, without the browser view."""
    children = Path(f"/proc/{server}/task/{server}/children").read_text().split()
    return [server, *(int(p) for p in children if "render_process" in _command(int(p)))]


def _command(pid: int) -> str:
    return Path(f"/proc/{pid}/cmdline").read_text()


def measure(scenario: str, port: int, page: int) -> list[tuple[float, float, float, float]]:
    """Of each pair: median wait and processor time for a frame [s], without and with a viewer."""
    address = f"tcp://127.0.0.1:{port}"
    arguments = [scenario, "--address", address, "--web", "--web-address", f"127.0.0.1:{page}"]
    server = start_server(arguments, stdout=subprocess.DEVNULL)
    pairs = []
    try:
        with Client(address, timeout_s=300.0) as client:
            now, camera = client.welcome.epoch_tai_ns, client.welcome.cameras[0].name
            pids = loop_processes(server.pid)
            url = f"http://127.0.0.1:{page}/stream/{camera}.mjpg"
            for pair in range(_PAIRS):
                results = {}
                # The order of the two changes, so that a drift cancels.
                for watched in (bool(pair % 2), not pair % 2):
                    reader = None
                    if watched:
                        reader = subprocess.Popen([sys.executable, "-c", _READER, url])
                        time.sleep(0.5)
                    waits, start = [], processor_seconds(pids)
                    for _ in range(_FRAMES):
                        now += _STEP_NS
                        before = time.perf_counter()
                        client.render(now, camera)
                        waits.append(time.perf_counter() - before)
                    used = (processor_seconds(pids) - start) / _FRAMES
                    results[watched] = statistics.median(waits), used
                    if reader is not None:
                        reader.kill()
                        reader.wait()
                        time.sleep(0.3)
                pairs.append((*results[False], *results[True]))
    finally:
        end(server, 10.0)
    return pairs


def main() -> None:
    """Measure and print."""
    scenario = sys.argv[1] if len(sys.argv) > 1 else "examples/approach.toml"
    pairs = measure(scenario, 5763, 5780)
    without, cpu_without, watched, cpu_watched = (
        statistics.median(values) for values in zip(*pairs, strict=True)
    )
    ratio = statistics.median(w / o for o, _, w, _ in pairs)
    cpu_ratio = statistics.median(w / o for _, o, _, w in pairs)
    print(f"frame time: {1e3 * without:.1f} ms, with a viewer {1e3 * watched:.1f} ms")
    print(f"median ratio of {len(pairs)} pairs: {100.0 * (ratio - 1.0):+.1f} %")
    print(f"processor time: {1e3 * cpu_without:.1f} ms, with a viewer {1e3 * cpu_watched:.1f} ms")
    print(f"median ratio: {100.0 * (cpu_ratio - 1.0):+.1f} %")


if __name__ == "__main__":
    main()
