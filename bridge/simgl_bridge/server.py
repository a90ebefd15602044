"""The server's loop: endpoints receive, clients take turns, one image is rendered at a time.

One thread does everything, because OpenGL is bound to it; ZeroMQ's own threads move the bytes.
Between two images every endpoint receives what has arrived.
"""

from __future__ import annotations

import math
import sys
import time
from collections import OrderedDict, deque
from collections.abc import Callable, Hashable, Sequence
from typing import Any, Protocol

import zmq

# Interval at which a stop is noticed while no request comes [s].
IDLE = 0.05
# After an image the server polls without sleeping for this long [s]: a client in lock-step sends
# its next request at once, and waking up takes 0.2 ms.
AWAKE = 0.001

Work = Callable[[], None]


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
        """Receive what has arrived: answer it at once, or queue it."""

    def update(self, now: float) -> float:
        """Do what is due at a time [s, monotonic]; returns when something is due again."""

    def farewell(self) -> None:
        """Tell the peers that the server leaves."""


class FairQueue:
    """Queued work by client; the client served last goes to the end.

    window : pieces of work of one client that may be queued
    """

    def __init__(self, window: int) -> None:
        self.window = window
        self._queues: OrderedDict[bytes, deque[tuple[Hashable, Work]]] = OrderedDict()

    def offer(self, client: bytes, key: Hashable, work: Work) -> bool:
        """Queue work under a key; False where the client's window is full."""
        queue = self._queues.setdefault(client, deque())
        if len(queue) >= self.window:
            return False
        queue.append((key, work))
        return True

    def has(self, client: bytes, key: Hashable) -> bool:
        """Whether work of this key is queued for a client."""
        return any(key == other for other, _ in self._queues.get(client, ()))

    def take(self) -> Work | None:
        """Remove and return the next work; None where there is none."""
        if not self._queues:
            return None
        client, queue = self._queues.popitem(last=False)
        _, work = queue.popleft()
        if queue:
            self._queues[client] = queue
        return work

    def drop(self, client: bytes) -> None:
        """Forget the work of a client that left."""
        self._queues.pop(client, None)

    def __len__(self) -> int:
        return sum(len(queue) for queue in self._queues.values())


def serve(endpoints: Sequence[Endpoint], queue: FairQueue, stop: Stop) -> None:
    """Answer until ``stop`` is set; an image being rendered is finished and sent first."""
    poller = zmq.Poller()
    for endpoint in endpoints:
        poller.register(endpoint.socket, zmq.POLLIN)
    awake_until = -math.inf
    while not stop.is_set():
        now = time.monotonic()
        due = min(endpoint.update(now) for endpoint in endpoints)
        wait = 0.0 if len(queue) or now < awake_until else max(min(due - now, IDLE), 0.0)
        poller.poll(round(wait * 1000.0))
        for endpoint in endpoints:
            endpoint.receive()
        work = queue.take()
        if work is not None:
            work()
            awake_until = time.monotonic() + AWAKE
    for endpoint in endpoints:
        endpoint.farewell()


def print_line(line: str) -> None:
    """Print a line to stderr; a full disk behind it must not stop the server."""
    try:
        print(line, file=sys.stderr, flush=True)
    except OSError:
        return
