"""A server that is started again when a fault kills its process: in a driver, or in libzmq.

A picture depends on request, scenario and seed alone, so the next reply is what it would have been.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import time
from collections.abc import Callable, Mapping
from typing import Any

from simgl.errors import BridgeError
from simgl_bridge.server import Stop

# A process that dies this soon after its start [s], so many times in a row, will go on dying.
SOON = 20.0
MOST = 5
# How soon a death, or the wish to stop, is noticed [s].
_GLANCE = 0.1


class WithParent:
    """A wish to stop that is also granted when the process that started this one is gone."""

    def __init__(self, stop: Stop) -> None:
        self._stop = stop
        self._parent = os.getppid()

    def is_set(self) -> bool:
        """Whether to stop now."""
        return self._stop.is_set() or os.getppid() != self._parent


def keep(target: Callable[..., None], arguments: Mapping[str, Any], stop: Stop) -> int:
    """Run a function in a process of its own, again whenever a signal kills it; its exit code.

    target, arguments : what ``multiprocessing`` can hand over; the process gets SIGTERM once
        ``stop`` is set

    Raises BridgeError where the process keeps dying.
    """
    context = multiprocessing.get_context("spawn")
    deaths = 0
    while True:
        began = time.monotonic()
        process = context.Process(target=target, kwargs=dict(arguments))
        process.start()
        _wait(process, stop)
        code = process.exitcode
        assert code is not None
        if code >= 0 or stop.is_set():
            return max(code, 0)
        deaths = deaths + 1 if time.monotonic() - began < SOON else 1
        name = signal.Signals(-code).name
        if deaths == MOST:
            raise BridgeError(f"the server died {MOST} times in a row, the last time of {name}")
        _say(f"simgl: the server died of {name} and is started again")


def _say(line: str) -> None:
    """A line to stderr, as far as stderr takes it: its disk may be full."""
    try:
        print(line, file=sys.stderr, flush=True)
    except OSError:
        return


def _wait(process: multiprocessing.process.BaseProcess, stop: Stop) -> None:
    asked = False
    while process.is_alive():
        if stop.is_set() and not asked:
            process.terminate()
            asked = True
        process.join(_GLANCE)
