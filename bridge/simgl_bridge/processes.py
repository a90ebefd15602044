"""Server processes: started as children that end with their parent, restarted, and ended."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from typing import Any

from simgl.errors import BridgeError
from simgl.interruption import block_interrupts
from simgl_bridge.server import Stop, print_line

# Names the process whose end stops a server.
PARENT_VARIABLE = "SIMGL_SERVER_PARENT"
# A server that dies this soon after its start [s], this many times in a row, is given up.
EARLY_DEATH = 20.0
MAX_EARLY_DEATHS = 5
# Interval at which an end, or the wish to stop, is noticed [s].
POLL_INTERVAL = 0.1


class StopWithParent:
    """A stop that is also set once a parent process is gone, however it ended."""

    def __init__(self, stop: Stop, parent: int) -> None:
        self._stop = stop
        self._parent = parent

    def is_set(self) -> bool:
        """Whether to stop now."""
        return self._stop.is_set() or os.getppid() != self._parent


def start_server(arguments: Sequence[str], **options: Any) -> subprocess.Popen[bytes]:
    """Start ``simgl serve`` as a child process; it ends when this process does.

    options : of ``subprocess.Popen``
    """
    command = [sys.executable, "-m", "simgl", "serve", *arguments]
    environment = {**os.environ, PARENT_VARIABLE: str(os.getpid())}
    return subprocess.Popen(command, env=environment, **options)


def end(process: subprocess.Popen[bytes], patience: float) -> None:
    """Ask a process to end, and kill it where it has not after a time [s]."""
    if process.poll() is None:
        process.terminate()
        try:
            process.wait(patience)
        except subprocess.TimeoutExpired:
            process.kill()
    process.wait()


def run_restarting(target: Callable[..., None], arguments: Sequence[Any], stop: Stop) -> int:
    """Run a function in a process of its own, again whenever a signal kills it.

    target, arguments : picklable; the process gets SIGTERM once ``stop`` is set
    returns : exit code of the process

    Raises BridgeError where the process keeps dying.
    """
    deaths = 0
    while True:
        start = time.monotonic()
        process = multiprocessing.get_context("spawn").Process(target=target, args=arguments)
        # Ctrl-C is for this process, which then ends the other one.
        block_interrupts()
        process.start()
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        while process.is_alive() and not stop.is_set():
            process.join(POLL_INTERVAL)
        if process.is_alive():
            process.terminate()
        process.join()
        code = process.exitcode or 0
        if code >= 0 or stop.is_set():
            return max(code, 0)
        deaths = deaths + 1 if time.monotonic() - start < EARLY_DEATH else 1
        name = signal.Signals(-code).name
        if deaths == MAX_EARLY_DEATHS:
            raise BridgeError(f"the server died {deaths} times in a row, the last time of {name}")
        print_line(f"simgl: the server died of {name} and is started again")
