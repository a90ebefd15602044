"""Runs a program that uses Basilisk beside its image source; both end when one of them ends.

Basilisk waits for its images without a deadline. The process that started both can see that none
will come.
"""

from __future__ import annotations

import subprocess
import time
from collections.abc import Sequence
from signal import Signals
from typing import Any

import zmq

from simgl.errors import BridgeError
from simgl_bridge.processes import end, start_server
from simgl_bridge.server import Stop

# Time for the server to start [s]: models are loaded, interreflection may be traced.
START_TIMEOUT = 120.0
# Interval at which the end of a process is noticed [s].
_POLL_INTERVAL = 0.05
# Interval between two pings of the server [s].
_PING_INTERVAL = 1.0
# A process that was asked to end is killed after this [s].
_PATIENCE = 5.0


class _Pinger:
    """Pings an image source without waiting.

    last_reply : when the last one came [s, monotonic]; None before the first
    """

    def __init__(self, address: str) -> None:
        self._context: zmq.Context[Any] = zmq.Context()
        self._socket = self._context.socket(zmq.DEALER)
        self._socket.linger = 0
        self._socket.connect(address)
        self._next_ping = 0.0
        self._waiting = False
        self.last_reply: float | None = None

    def update(self, now: float) -> None:
        while self._socket.poll(0):
            self._socket.recv_multipart()
            self.last_reply, self._waiting = now, False
        if not self._waiting and now >= self._next_ping:
            # An empty frame comes first, as from a REQ socket.
            self._socket.send_multipart([b"", b"PING"], zmq.NOBLOCK)
            self._next_ping, self._waiting = now + _PING_INTERVAL, True

    def close(self) -> None:
        self._context.destroy(linger=0)


def run_with_server(
    arguments: Sequence[str], address: str, command: Sequence[str], *, patience: float, stop: Stop
) -> int:
    """Start an image source at an address, then a program; returns the program's exit code.

    arguments : of ``simgl serve``
    patience : a server that answers no ping for so long [s] is given up
    stop : ends both; the exit code is then 130

    Raises BridgeError, with the program ended, where the server ends or blocks before it.
    """
    server = start_server(arguments)
    program: subprocess.Popen[bytes] | None = None
    pinger = _Pinger(address)
    start = time.monotonic()
    try:
        while not stop.is_set():
            # Checked first, since the program may end the server when it ends.
            if program is not None and (code := program.poll()) is not None:
                return code if code >= 0 else 128 - code
            now = time.monotonic()
            pinger.update(now)
            if (code := server.poll()) is not None:
                reason = f"died of {Signals(-code).name}" if code < 0 else f"ended with code {code}"
                raise BridgeError(f"the image source {reason}{_consequence(program, command)}")
            limit = START_TIMEOUT if pinger.last_reply is None else patience
            if now - (pinger.last_reply or start) > limit:
                problem = f"the image source at {address} gave no sign of life for {limit:g} s"
                raise BridgeError(f"{problem}{_consequence(program, command)}")
            if program is None and pinger.last_reply is not None:
                program = _started(command)
            time.sleep(_POLL_INTERVAL)
        return 130
    finally:
        pinger.close()
        for process in (program, server):
            if process is not None:
                end(process, _PATIENCE)


def _started(command: Sequence[str]) -> subprocess.Popen[bytes]:
    try:
        return subprocess.Popen(command)
    except OSError as error:
        raise BridgeError(f"{command[0]}: cannot be started ({error.strerror})") from None


def _consequence(program: subprocess.Popen[bytes] | None, command: Sequence[str]) -> str:
    # A program given as text has many lines.
    name = " ".join(" ".join(command).split())
    name = name if len(name) <= 60 else f"{name[:57]}..."
    return f"; {name} was not begun" if program is None else f"; {name} is ended with it"
