"""The server's loop: fronts listen, requests take turns, one picture is in hand at a time.

One thread does everything, because OpenGL stays on one; ZeroMQ's own threads move the bytes.
Between two pictures every front hands in what has arrived.
"""

from __future__ import annotations

import math
import sys
import time
import traceback
from collections.abc import Sequence
from typing import Any, Protocol

import zmq

from simgl_bridge.fair_queue import FairQueue

# How soon a stop is noticed while no request comes [s].
IDLE = 0.05
# After a picture the server stays awake so long [s]: a client in lock-step asks again at once, and
# to be woken takes a fifth of a millisecond.
AWAKE = 0.001


class Stop(Protocol):
    """What ends the service; a ``threading.Event`` is one."""

    def is_set(self) -> bool:
        """Whether to stop now."""


class Endpoint(Protocol):
    """One protocol at one address. Nothing that a peer sends may raise."""

    @property
    def socket(self) -> zmq.Socket[Any]:
        """Where requests arrive."""

    def receive(self) -> None:
        """Take in what has arrived: answer at once, or let it wait its turn."""

    def tick(self, now: float) -> float:
        """Do what is due at a time [s, monotonic]; returns when something is due again."""

    def farewell(self) -> None:
        """Tell the peers that the server leaves."""


def serve(fronts: Sequence[Endpoint], queue: FairQueue, stop: Stop) -> None:
    """Answer until ``stop`` is set; a picture in hand is finished and sent first."""
    poller = zmq.Poller()
    for front in fronts:
        poller.register(front.socket, zmq.POLLIN)
    awake = -math.inf
    while not stop.is_set():
        now = time.monotonic()
        due = min(front.tick(now) for front in fronts)
        wait = 0.0 if len(queue) or now < awake else max(min(due - now, IDLE), 0.0)
        poller.poll(round(wait * 1000.0))
        for front in fronts:
            front.receive()
        work = queue.take()
        if work is not None:
            work()
            awake = time.monotonic() + AWAKE
    for front in fronts:
        front.farewell()


def report_failure() -> None:
    """The exception in hand to stderr, as far as stderr takes it: its disk may be full."""
    try:
        traceback.print_exc(file=sys.stderr)
        sys.stderr.flush()
    except OSError:
        return
