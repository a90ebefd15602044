"""The server's loop: endpoints receive, clients take turns, one image is rendered at a time.

The loop never waits for the renderer, which is another process: whatever is drawn, requests that
need no image are answered within milliseconds.
"""

from __future__ import annotations

import math
import sys
import time
from collections import OrderedDict, deque
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import zmq

if TYPE_CHECKING:
    from simgl_bridge.render_queue import RenderQueue
    from simgl_bridge.renderer_link import Payload
    from simgl_bridge.renderer_messages import Answer, Task

# Interval at which a stop, or the end of the renderer, is noticed [s].
IDLE = 0.05


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


@dataclass(frozen=True, kw_only=True, eq=False)
class Work:
    """A request that needs the renderer. None of its functions raises.

    key : equal for a request and its repetition
    begin : called at its turn; returns None where it was answered without the renderer
    finish : called with the renderer's answer; at the end with whether it came too late
    deadline : when ``overdue`` is called [s, monotonic], unless it is finished by then
    """

    begin: Callable[[], Task | None]
    finish: Callable[[Answer, Payload, bool], None]
    key: Hashable = None
    deadline: float = math.inf
    overdue: Callable[[], None] = lambda: None


class FairQueue:
    """Queued work by client; the client served last goes to the end.

    window : pieces of work of one client that may be queued
    """

    def __init__(self, window: int) -> None:
        self.window = window
        self._queues: OrderedDict[bytes, deque[Work]] = OrderedDict()

    def offer(self, client: bytes, work: Work) -> bool:
        """Queue work; False where the client's window is full."""
        queue = self._queues.setdefault(client, deque())
        if len(queue) >= self.window:
            return False
        queue.append(work)
        return True

    def has(self, client: bytes, key: Hashable) -> bool:
        """Whether work of this key is queued for a client."""
        return any(key == work.key for work in self._queues.get(client, ()))

    def take(self) -> tuple[bytes, Work] | None:
        """Remove and return the next work with its client; None where there is none."""
        if not self._queues:
            return None
        client, queue = self._queues.popitem(last=False)
        work = queue.popleft()
        if queue:
            self._queues[client] = queue
        return client, work

    def take_overdue(self, now: float) -> list[Work]:
        """Remove and return the work whose deadline is over."""
        late = [work for queue in self._queues.values() for work in queue if now >= work.deadline]
        for work in late:
            for client, queue in list(self._queues.items()):
                if work in queue:
                    queue.remove(work)
                    if not queue:
                        del self._queues[client]
        return late

    def next_deadline(self) -> float:
        """The first deadline [s, monotonic]."""
        return min((w.deadline for q in self._queues.values() for w in q), default=math.inf)

    def drop(self, client: bytes) -> None:
        """Forget the work of a client that left."""
        self._queues.pop(client, None)

    def __len__(self) -> int:
        return sum(len(queue) for queue in self._queues.values())


def serve(
    endpoints: Sequence[Endpoint],
    queue: RenderQueue,
    stop: Stop,
    on_ready: Callable[[], None] = lambda: None,
) -> None:
    """Answer until ``stop`` is set; an image being rendered is finished and sent first.

    on_ready : called once, when the renderer is ready for the first time

    Raises BridgeError where the renderer cannot start, or keeps dying.
    """
    queue.start()
    was_ready = False
    try:
        while not stop.is_set() or queue.is_awaited:
            now = time.monotonic()
            due = min(queue.update(now), *(endpoint.update(now) for endpoint in endpoints))
            wait = max(min(due - now, IDLE), 0.0)
            poller = zmq.Poller()
            for socket in (*queue.connections, *(endpoint.socket for endpoint in endpoints)):
                poller.register(socket, zmq.POLLIN)
            poller.poll(math.ceil(wait * 1000.0))
            for endpoint in endpoints:
                endpoint.receive()
            queue.take_answers()
            if not stop.is_set():
                queue.begin_next()
            if not was_ready and queue.scene is not None:
                was_ready = True
                on_ready()
    finally:
        for endpoint in endpoints:
            endpoint.farewell()


def print_line(line: str) -> None:
    """Print a line to stderr; a full disk behind it must not stop the server."""
    try:
        print(line, file=sys.stderr, flush=True)
    except OSError:
        return
