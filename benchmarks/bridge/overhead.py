"""The loop without rendering beside its floor: a full-size picture that is ready at once.

The floor is a bare ZeroMQ socket that answers with the same number of bytes. Both are asked in
turns, some round trips each, so that whatever else the machine does falls on both alike.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np
import zmq
from simgl_bridge import Client

from benchmarks.bridge.scene import SMALL, chaser, machine, server_process

SIZES = ((64, 48), (640, 480), (1280, 960), (2048, 2048))
# Round trips of one kind before it is the other's turn.
BLOCK = 50
# As long as a request for one camera with one pose.
REQUEST_BYTES = 300

RoundTrip = Callable[[int], None]


class Course:
    """Round trips of one kind: their times, and what both processes worked for them."""

    def __init__(self, server: int, round_trip: RoundTrip) -> None:
        self._server = server
        self._round_trip = round_trip
        self._done = 0
        self.seconds: list[float] = []
        self.worked = np.zeros(2)

    def go(self, count: int, warm: bool = False) -> None:
        """Some more; ``warm`` ones are not counted."""
        before = self._work()
        for _ in range(count):
            start = time.perf_counter()
            self._round_trip(self._done)
            self._done += 1
            if not warm:
                self.seconds.append(time.perf_counter() - start)
        if not warm:
            self.worked += self._work() - before

    def _work(self) -> np.ndarray:
        return np.array([work_seconds(os.getpid()), work_seconds(self._server)])


def work_seconds(pid: int) -> float:
    """Processor time of all threads of a process [s], to the nanosecond."""
    threads = Path(f"/proc/{pid}/task").glob("*/schedstat")
    return sum(int(t.read_text().split()[0]) for t in threads) * 1e-9


def overhead(frames: int, folder: Path) -> dict[str, object]:
    """Round trips as a client sees them, beside those of the floor, by size and transport [ms].

    p50 and p99 of the times; processor time of client and server, per round trip.
    """
    rows = []
    for width, height in SIZES:
        for transport in ("ipc", "tcp"):
            row = _side_by_side(width, height, transport, frames, folder)
            print(_line(row), file=sys.stderr, flush=True)
            rows.append(row)
    return {**machine(), "frames": frames, "round_trips": rows}


def _line(row: dict[str, object]) -> str:
    return (
        f"{row['width']:>4} x {row['height']:<4} {row['transport']}:  "
        f"p50 {row['p50_ms']:6.3f}  p99 {row['p99_ms']:6.3f}  "
        f"work {row['client_ms']:5.3f} + {row['server_ms']:5.3f}   "
        f"floor  p50 {row['floor_p50_ms']:6.3f}  p99 {row['floor_p99_ms']:6.3f}  "
        f"work {row['floor_client_ms']:5.3f} + {row['floor_server_ms']:5.3f} ms"
    )


def _side_by_side(
    width: int, height: int, transport: str, frames: int, folder: Path
) -> dict[str, object]:
    text = SMALL.replace("width_px = 64", f"width_px = {width}")
    path = folder / f"{width}.toml"
    path.write_text(text.replace("height_px = 48", f"height_px = {height}"))
    addresses = [f"ipc://{folder / name}" for name in ("loop", "floor")]
    if transport == "tcp":
        addresses = ["tcp://127.0.0.1:5597", "tcp://127.0.0.1:5598"]
    with ExitStack() as stack:
        loop = stack.enter_context(_loop(path, addresses[0]))
        floor = stack.enter_context(_floor(width, height, addresses[1]))
        for course in (loop, floor):
            course.go(max(frames // 10, BLOCK), warm=True)
        for _ in range(-(-frames // BLOCK)):
            loop.go(BLOCK)
            floor.go(BLOCK)
    row: dict[str, object] = {"width": width, "height": height, "transport": transport}
    for prefix, course in (("", loop), ("floor_", floor)):
        p50, p99 = np.percentile(np.array(course.seconds) * 1e3, [50.0, 99.0])
        client, server = course.worked * 1e3 / len(course.seconds)
        numbers = {"p50": p50, "p99": p99, "client": client, "server": server}
        row |= {f"{prefix}{name}_ms": round(float(v), 3) for name, v in numbers.items()}
    return row


@contextmanager
def _loop(scenario: Path, address: str) -> Iterator[Course]:
    with (
        server_process("benchmarks.bridge.still", str(scenario), address=address) as pid,
        Client(address, timeout_s=20.0) as client,
    ):
        epoch = client.welcome.epoch_tai_ns

        def round_trip(step: int) -> None:
            image = client.render(epoch + step, "nav", {"chaser": chaser(step % 100)})
            # Read once, as any use of it would.
            assert int(image.dn.max()) < 4000

        yield Course(pid, round_trip)


@contextmanager
def _floor(width: int, height: int, address: str) -> Iterator[Course]:
    command = [sys.executable, "-m", "benchmarks.bridge.echo", str(width), str(height)]
    process = subprocess.Popen([*command, "--address", address])
    context = zmq.Context()
    try:
        socket = context.socket(zmq.DEALER)
        socket.connect(address)
        request = [b"simgl/1", bytes(REQUEST_BYTES)]

        def round_trip(step: int) -> None:  # noqa: ARG001 - always the same picture
            socket.send_multipart(request)
            assert socket.poll(20_000), "the echo is silent"
            pixels = socket.recv_multipart(copy=False)[2].buffer
            assert int(np.frombuffer(pixels, dtype=np.uint16).max()) < 4000

        yield Course(process.pid, round_trip)
    finally:
        context.destroy(linger=0)
        process.terminate()
        process.wait(20)
