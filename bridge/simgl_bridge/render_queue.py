"""The requests that need the renderer: whose turn it is, and what the renderer has in hand."""

from __future__ import annotations

import math
import time
from collections.abc import Hashable
from dataclasses import dataclass

from simgl_bridge.message_parts import ServerStatus
from simgl_bridge.renderer_link import LONGEST_DRAW, Payload, RendererLink
from simgl_bridge.renderer_messages import Answer, ServedScene
from simgl_bridge.server import FairQueue, Work
from simgl_bridge.shared_frames import Connection

# Requests of one client that may be queued: n + 1 is rendered while n travels.
WINDOW = 2


@dataclass(eq=False)
class _Current:
    """What the renderer has in hand.

    limit : when it is given up [s, monotonic]
    late : its deadline is over, and its client was told
    dropped : its client has left
    """

    client: bytes
    work: Work
    limit: float
    late: bool = False
    dropped: bool = False

    @property
    def is_awaited(self) -> bool:
        return not (self.late or self.dropped)


class RenderQueue:
    """Work of all endpoints, one piece after another, and the renderer that does it."""

    def __init__(self, renderer: RendererLink) -> None:
        self._renderer = renderer
        self._waiting = FairQueue(WINDOW)
        self._current: _Current | None = None

    def start(self) -> None:
        """Start the renderer."""
        self._renderer.start()

    @property
    def connections(self) -> list[Connection]:
        """Where answers of the renderer arrive."""
        return self._renderer.connections

    @property
    def status(self) -> ServerStatus:
        """What the renderer is doing."""
        return self._renderer.status

    @property
    def scene(self) -> ServedScene | None:
        """What is served; None before the renderer was first ready."""
        return self._renderer.scene

    @property
    def window(self) -> int:
        """Pieces of work of one client that may wait."""
        return self._waiting.window

    @property
    def is_awaited(self) -> bool:
        """Whether a client waits for what the renderer has in hand."""
        return self._current is not None and self._current.is_awaited

    def offer(self, client: bytes, work: Work) -> bool:
        """Queue work; False where the client's window is full."""
        return self._waiting.offer(client, work)

    def has(self, client: bytes, key: Hashable) -> bool:
        """Whether work of this key waits or is in hand, so that its answer will come."""
        current = self._current
        if current is not None and current.is_awaited and current.client == client:
            return current.work.key == key or self._waiting.has(client, key)
        return self._waiting.has(client, key)

    def drop(self, client: bytes) -> None:
        """Forget the work of a client that left."""
        self._waiting.drop(client)
        if self._current is not None and self._current.client == client:
            self._current.dropped = True

    def __len__(self) -> int:
        return len(self._waiting)

    def update(self, now: float) -> float:
        """Refuse what is too late; returns when something is due again [s, monotonic]."""
        for work in self._waiting.take_overdue(now):
            work.overdue()
        due = self._waiting.next_deadline()
        current = self._current
        if current is None:
            return due
        if current.is_awaited:
            if now < current.work.deadline:
                due = min(due, current.work.deadline)
            else:
                current.late = True
                current.work.overdue()
        if now >= current.limit:
            for answer, payload in self._renderer.give_up_task():
                self._finish(answer, payload)
        return due

    def take_answers(self) -> None:
        """Pass on what the renderer answered."""
        for answer, payload in self._renderer.answers():
            self._finish(answer, payload)

    def begin_next(self) -> None:
        """Give the renderer the next work if it is free."""
        while self._renderer.is_free and (taken := self._waiting.take()) is not None:
            client, work = taken
            if (task := work.begin()) is None:
                continue
            deadline = work.deadline if work.deadline < math.inf else 0.0
            limit = max(time.monotonic() + LONGEST_DRAW, deadline)
            self._current = _Current(client, work, limit)
            self._renderer.begin(task)

    def _finish(self, answer: Answer, payload: Payload) -> None:
        current, self._current = self._current, None
        if current is not None and not current.dropped:
            current.work.finish(answer, payload, current.late)
