"""A run of Basilisk beside its image source: neither goes on once the other has ended.

Basilisk waits for its pictures without a deadline. Who started both can see that none will come.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Sequence
from signal import Signals
from typing import Any

import zmq

from simgl.errors import BridgeError
from simgl_bridge.launched_server import end
from simgl_bridge.server import Stop

# For the server to start [s]: models are loaded, light between surfaces may be traced.
START = 120.0
# How soon an end is noticed [s].
_GLANCE = 0.05
# Between two questions whether the server is there [s].
_ASK_EVERY = 1.0
# A process that was asked to end is killed after this [s].
_GRACE = 5.0


class _Knock:
    """Asks an image source for a sign of life, and waits for nothing.

    heard : when the last one came [s, monotonic]; None before the first
    """

    def __init__(self, address: str) -> None:
        self._context: zmq.Context[Any] = zmq.Context()
        self._socket = self._context.socket(zmq.DEALER)
        self._socket.linger = 0
        self._socket.connect(address)
        self._next = 0.0
        self._open = False
        self.heard: float | None = None

    def __call__(self, now: float) -> None:
        while self._socket.poll(0):
            self._socket.recv_multipart()
            self.heard, self._open = now, False
        if not self._open and now >= self._next:
            # An empty frame comes first, as from a REQ socket.
            self._socket.send_multipart([b"", b"PING"], zmq.NOBLOCK)
            self._next, self._open = now + _ASK_EVERY, True

    def close(self) -> None:
        self._context.destroy(linger=0)


def escort(
    server: Sequence[str], address: str, program: Sequence[str], *, patience: float, stop: Stop
) -> int:
    """Start an image source at an address, then a program; the program's exit code.

    server : command line of the image source
    patience : a server that gives no sign of life for so long [s], once it runs, is given up
    stop : ends both; the exit code is then 130

    Raises BridgeError, with the program ended, where the server ends or is silent before it.
    """
    source = subprocess.Popen(server)
    client: subprocess.Popen[bytes] | None = None
    knock = _Knock(address)
    began = time.monotonic()
    try:
        while not stop.is_set():
            # First, since what the program does at its end may end the server.
            if client is not None and (code := client.poll()) is not None:
                return code if code >= 0 else 128 - code
            now = time.monotonic()
            knock(now)
            if (code := source.poll()) is not None:
                raise BridgeError(f"the image source {_end(code)}{_whose(client, program)}")
            limit = START if knock.heard is None else patience
            if now - (knock.heard or began) > limit:
                problem = f"the image source at {address} gave no sign of life for {limit:g} s"
                raise BridgeError(f"{problem}{_whose(client, program)}")
            if client is None and knock.heard is not None:
                client = _started(program)
            time.sleep(_GLANCE)
        return 130
    finally:
        knock.close()
        for process in (client, source):
            if process is not None:
                end(process, _GRACE)


def server_command(arguments: Sequence[str]) -> list[str]:
    """Command line of ``simgl serve`` with arguments."""
    return [sys.executable, "-m", "simgl_bridge.commands", *arguments]


def _started(program: Sequence[str]) -> subprocess.Popen[bytes]:
    try:
        return subprocess.Popen(program)
    except OSError as error:
        raise BridgeError(f"{program[0]}: cannot be started ({error.strerror})") from None


def _end(code: int) -> str:
    return f"died of {Signals(-code).name}" if code < 0 else f"ended with code {code}"


def _whose(client: subprocess.Popen[bytes] | None, program: Sequence[str]) -> str:
    # A program given as text has many lines.
    name = " ".join(" ".join(program).split())
    name = name if len(name) <= 60 else f"{name[:57]}..."
    return f"; {name} was not begun" if client is None else f"; {name} is ended with it"
