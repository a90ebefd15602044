"""Free-run: the newest state, whose it is, its picture, and who waits for the next one."""

from __future__ import annotations

from dataclasses import dataclass

from simgl_bridge.messages import Images, Next, State
from simgl_bridge.reply_cache import Frames

# An owner that says nothing for this long has left [s].
OWNER_SILENCE = 10.0
# A client that waits for a picture asks again after this [s].
LONGEST_WAIT = 10.0
# Clients that may wait at once.
MOST_WAITING = 256


@dataclass(frozen=True)
class Shown:
    """A picture of the stream: its reply but for the id, and the payload frames."""

    images: Images
    pixels: Frames


class Stream:
    """The newest state and what became of the ones before.

    interval : least time between two pictures [s]
    """

    def __init__(self, interval: float) -> None:
        self._interval = interval
        self._due = 0.0
        self._owner: bytes | None = None
        self._heard = 0.0
        self._newest: State | None = None
        self._dropped = 0
        self._waiting: dict[bytes, tuple[Next, float]] = {}
        self.owner_name = ""
        self.shown: Shown | None = None

    def accept(self, client: bytes, name: str, state: State, now: float) -> bool:
        """Take a client's state as the newest; False where the stream is another's."""
        if self._owner != client:
            if self._owner is not None and now - self._heard < OWNER_SILENCE:
                return False
            # The pictures of another simulation are nothing to this one.
            self.forget(self._owner)
        self._owner, self.owner_name, self._heard = client, name, now
        if self._newest is not None:
            self._dropped += 1
        self._newest = state
        return True

    def forget(self, client: bytes | None) -> None:
        """Free the stream of its owner, or the place of one that waits."""
        if client is None:
            return
        self._waiting.pop(client, None)
        if client == self._owner:
            self._owner, self._newest, self._dropped, self.shown = None, None, 0, None

    def due(self, now: float) -> bool:
        """Whether a state waits to be shown, and its time has come."""
        return self._newest is not None and now >= self._due

    def take(self, now: float) -> tuple[bytes, State, int] | None:
        """Owner, newest state, and how many it replaced unseen; None where the owner has left."""
        if self._newest is None or self._owner is None:
            return None
        state, dropped = self._newest, self._dropped
        self._newest, self._dropped = None, 0
        self._due = now + self._interval
        return self._owner, state, dropped

    def wait(self, client: bytes, request: Next, now: float) -> bool:
        """Let a client wait for the next picture; False where too many do."""
        if len(self._waiting) >= MOST_WAITING and client not in self._waiting:
            return False
        asked = request.deadline_ms
        seconds = LONGEST_WAIT if asked is None else min(asked * 1e-3, LONGEST_WAIT)
        self._waiting[client] = (request, now + seconds)
        return True

    def answered(self) -> list[tuple[bytes, Next]]:
        """Those whose picture is there; they wait no longer."""
        if self.shown is None:
            return []
        sequence = self.shown.images.sequence
        ready = [(c, r) for c, (r, _) in self._waiting.items() if sequence > r.after]
        for client, _ in ready:
            del self._waiting[client]
        return ready

    def overdue(self, now: float) -> list[tuple[bytes, Next]]:
        """Those who waited too long; they wait no longer."""
        late = [(c, r) for c, (r, deadline) in self._waiting.items() if now >= deadline]
        for client, _ in late:
            del self._waiting[client]
        return late

    def next_event(self) -> float:
        """When something is due at the latest [s, monotonic]."""
        times = [deadline for _, deadline in self._waiting.values()]
        if self._newest is not None:
            times.append(self._due)
        return min(times, default=float("inf"))
