"""Whose turn is it? Pictures wait here, a few for each client, and clients take turns."""

from __future__ import annotations

from collections import OrderedDict, deque
from collections.abc import Callable, Hashable

Work = Callable[[], None]


class FairQueue:
    """Waiting work by client; the client served last goes to the end.

    window : pieces of work of one client that may wait
    """

    def __init__(self, window: int) -> None:
        self.window = window
        self._waiting: OrderedDict[bytes, deque[tuple[Hashable, Work]]] = OrderedDict()

    def offer(self, client: bytes, key: Hashable, work: Work) -> bool:
        """Let work wait under a key; False where the client's window is full."""
        line = self._waiting.setdefault(client, deque())
        if len(line) >= self.window:
            return False
        line.append((key, work))
        return True

    def waits(self, client: bytes, key: Hashable) -> bool:
        """Whether a client's work of this key waits."""
        return any(key == other for other, _ in self._waiting.get(client, ()))

    def take(self) -> Work | None:
        """The next work, no longer waiting; None where there is none."""
        if not self._waiting:
            return None
        client, line = self._waiting.popitem(last=False)
        _, work = line.popleft()
        if line:
            self._waiting[client] = line
        return work

    def drop(self, client: bytes) -> None:
        """Forget the work of a client that left."""
        self._waiting.pop(client, None)

    def __len__(self) -> int:
        return sum(len(line) for line in self._waiting.values())
