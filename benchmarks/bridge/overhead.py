"""Cost of the loop without rendering, beside that of a bare ZeroMQ socket.

Round trips of the Python client and of the C++ one for a full-size image. The floor is a ZeroMQ
socket that answers with the same number of bytes. They run in turns, some round trips each, so that
other load of the machine affects all alike.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np
import zmq
from simgl_bridge import Client
from simgl_bridge.sockets import LOOPBACK_RECEIVE_BUFFER

from benchmarks.bridge.scene import chaser, machine, scenario_file, server_process

SIZES = ((64, 48), (640, 480), (1280, 960), (2048, 2048))
# Round trips of one kind before the next kind's turn.
BLOCK = 50
# As long as a request for one camera with one pose.
REQUEST_BYTES = 300
# Prefix of the keys in a row, and name.
KINDS = (("", "Python"), ("cpp_", "C++"), ("floor_", "floor"))

# Makes round trips, from a first number and by count; returns the seconds of each.
RoundTrips = Callable[[int, int], list[float]]


class Series:
    """Round trips of one kind: their times, and the processor time of both processes.

    client, server : process ids
    """

    def __init__(self, client: int, server: int, round_trips: RoundTrips) -> None:
        self._processes = (client, server)
        self._round_trips = round_trips
        self._done = 0
        self.seconds: list[float] = []
        self.processor_time = np.zeros(2)

    def run(self, count: int, warm: bool = False) -> None:
        """Make more; those with ``warm`` are not counted."""
        start = self._processor_time()
        seconds = self._round_trips(self._done, count)
        self._done += count
        if not warm:
            self.seconds += seconds
            self.processor_time += self._processor_time() - start

    def _processor_time(self) -> np.ndarray:
        return np.array([processor_seconds(pid) for pid in self._processes])


def processor_seconds(pid: int) -> float:
    """Processor time of all threads of a process [s], to the nanosecond."""
    threads = Path(f"/proc/{pid}/task").glob("*/schedstat")
    return sum(int(t.read_text().split()[0]) for t in threads) * 1e-9


def overhead(frames: int, folder: Path) -> dict[str, object]:
    """Round trips of the clients and of the floor, by size and transport [ms].

    p50 and p99 of the times; processor time of client and server, per round trip. By the Python
    client, ``cpp_`` by the C++ one where there is a compiler, and ``floor_``.
    """
    rows = []
    compiled = _compiled(folder)
    for width, height in SIZES:
        for transport in ("ipc", "tcp"):
            row = _side_by_side(width, height, transport, frames, folder, compiled)
            print(_line(row), file=sys.stderr, flush=True)
            rows.append(row)
    return {**machine(), "frames": frames, "round_trips": rows}


def _line(row: dict[str, object]) -> str:
    def numbers(prefix: str) -> str:
        p50, p99, client, server = (
            row[f"{prefix}{name}_ms"] for name in ("p50", "p99", "client", "server")
        )
        return f"p50 {p50:6.3f}  p99 {p99:6.3f}  work {client:5.3f} + {server:5.3f}"

    kinds = [f"{name}: {numbers(prefix)}" for prefix, name in KINDS if f"{prefix}p50_ms" in row]
    return f"{row['width']:>4} x {row['height']:<4} {row['transport']}:  " + "   ".join(kinds)


def _compiled(folder: Path) -> Path | None:
    """The C++ client's round trips as a program; None where there is no compiler."""
    compiler = shutil.which(os.environ.get("CXX", "g++"))
    if compiler is None:
        return None
    program, source = folder / "round_trips", Path(__file__).with_name("round_trips.cpp")
    headers = source.parents[2] / "bridge" / "cpp"
    options = ["-std=c++17", "-O3", f"-I{headers}", "-o", str(program), "-lzmq"]
    subprocess.run([compiler, str(source), *options], check=True)
    return program


def _side_by_side(
    width: int, height: int, transport: str, frames: int, folder: Path, compiled: Path | None
) -> dict[str, object]:
    path = scenario_file(folder, width, height)
    addresses = [f"ipc://{folder / name}" for name in ("loop", "floor")]
    if transport == "tcp":
        addresses = ["tcp://127.0.0.1:5597", "tcp://127.0.0.1:5598"]
    with ExitStack() as stack:
        server = stack.enter_context(
            server_process("benchmarks.bridge.still", str(path), address=addresses[0])
        )
        all_series = {"": stack.enter_context(_python(addresses[0], server))}
        if compiled is not None:
            all_series["cpp_"] = stack.enter_context(_cpp(compiled, addresses[0], server))
        all_series["floor_"] = stack.enter_context(_floor(width, height, addresses[1]))
        for series in all_series.values():
            series.run(max(frames // 10, BLOCK), warm=True)
        for _ in range(-(-frames // BLOCK)):
            for series in all_series.values():
                series.run(BLOCK)
    row: dict[str, object] = {"width": width, "height": height, "transport": transport}
    for prefix, series in all_series.items():
        p50, p99 = np.percentile(np.array(series.seconds) * 1e3, [50.0, 99.0])
        client, server_time = series.processor_time * 1e3 / len(series.seconds)
        numbers = {"p50": p50, "p99": p99, "client": client, "server": server_time}
        row |= {f"{prefix}{name}_ms": round(float(v), 3) for name, v in numbers.items()}
    return row


def _timed(round_trip: Callable[[int], None]) -> RoundTrips:
    def round_trips(first: int, count: int) -> list[float]:
        seconds = []
        for step in range(first, first + count):
            start = time.perf_counter()
            round_trip(step)
            seconds.append(time.perf_counter() - start)
        return seconds

    return round_trips


@contextmanager
def _python(address: str, server: int) -> Iterator[Series]:
    with Client(address, timeout_s=20.0) as client:
        epoch = client.welcome.epoch_tai_ns

        def round_trip(step: int) -> None:
            image = client.render(epoch + step, "nav", {"chaser": chaser(step % 100)})
            # Read once, as any use of it would.
            assert int(image.dn.max()) < 4000

        yield Series(os.getpid(), server, _timed(round_trip))


@contextmanager
def _cpp(program: Path, address: str, server: int) -> Iterator[Series]:
    pipe = subprocess.PIPE
    with subprocess.Popen([program, address], stdin=pipe, stdout=pipe, text=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        requests, replies = process.stdin, process.stdout

        def round_trips(first: int, count: int) -> list[float]:  # noqa: ARG001 - it counts itself
            print(count, file=requests, flush=True)
            return [int(replies.readline()) * 1e-9 for _ in range(count)]

        yield Series(process.pid, server, round_trips)


@contextmanager
def _floor(width: int, height: int, address: str) -> Iterator[Series]:
    command = [sys.executable, "-m", "benchmarks.bridge.echo", str(width), str(height)]
    process = subprocess.Popen([*command, "--address", address])
    context = zmq.Context()
    try:
        socket = context.socket(zmq.DEALER)
        socket.setsockopt(zmq.RCVBUF, LOOPBACK_RECEIVE_BUFFER)
        socket.connect(address)
        request = [b"simgl/1", bytes(REQUEST_BYTES)]

        def round_trip(step: int) -> None:  # noqa: ARG001 - always the same image
            socket.send_multipart(request)
            assert socket.poll(20_000), "the echo is silent"
            pixels = socket.recv_multipart(copy=False)[2].buffer
            assert int(np.frombuffer(pixels, dtype=np.uint16).max()) < 4000

        yield Series(os.getpid(), process.pid, _timed(round_trip))
    finally:
        context.destroy(linger=0)
        process.terminate()
        process.wait(20)
