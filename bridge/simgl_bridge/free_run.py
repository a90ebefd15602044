"""Free-run: the newest state, its owner, its images, and the clients that wait for them."""

from __future__ import annotations

from dataclasses import dataclass

from simgl_bridge.client_sessions import OWNER_SILENCE, Frames
from simgl_bridge.messages import Images, Next, State

# A client that waits for images sends its request again after this [s].
LONGEST_WAIT = 10.0
# Clients that may wait at once.
MAX_WAITING_CLIENTS = 256


@dataclass(frozen=True)
class StreamedImages:
    """The last images of the stream: their reply except for its id, and the payload frames."""

    images: Images
    pixels: Frames


class StateStream:
    """The newest state, and how many were replaced unrendered.

    interval : shortest time between two replies with images [s]
    """

    def __init__(self, interval: float) -> None:
        self._interval = interval
        self._due = 0.0
        self.owner: bytes | None = None
        self._owner_heard = 0.0
        self._newest: State | None = None
        self._dropped = 0
        self._waiting: dict[bytes, tuple[Next, float]] = {}
        self.owner_name = ""
        self.last: StreamedImages | None = None

    def accept(self, client: bytes, name: str, state: State, now: float) -> bool:
        """Take a client's state as the newest; False where another client owns the stream."""
        if self.owner != client:
            if self.owner is not None and now - self._owner_heard < OWNER_SILENCE:
                return False
            # Images of another simulation mean nothing to this one.
            self.forget(self.owner)
        self.owner, self.owner_name, self._owner_heard = client, name, now
        if self._newest is not None:
            self._dropped += 1
        self._newest = state
        return True

    def forget(self, client: bytes | None) -> None:
        """Free the stream of a client that left, as its owner or as one that waits."""
        if client is None:
            return
        self._waiting.pop(client, None)
        if client == self.owner:
            self.owner, self._newest, self._dropped, self.last = None, None, 0, None

    def due(self, now: float) -> bool:
        """Whether a state is to be rendered now."""
        return self._newest is not None and now >= self._due

    def take(self, now: float) -> tuple[bytes, State, int] | None:
        """Owner, newest state, and how many it replaced; None where the owner has left."""
        if self._newest is None or self.owner is None:
            return None
        state, dropped = self._newest, self._dropped
        self._newest, self._dropped = None, 0
        self._due = now + self._interval
        return self.owner, state, dropped

    def wait(self, client: bytes, request: Next, now: float) -> bool:
        """Let a client wait for the next images; False where too many do."""
        if len(self._waiting) >= MAX_WAITING_CLIENTS and client not in self._waiting:
            return False
        asked = request.deadline_ms
        seconds = LONGEST_WAIT if asked is None else min(asked * 1e-3, LONGEST_WAIT)
        self._waiting[client] = (request, now + seconds)
        return True

    def take_answered(self) -> list[tuple[bytes, Next]]:
        """Remove and return the requests that the last images answer."""
        if self.last is None:
            return []
        sequence = self.last.images.sequence
        return self._remove([c for c, (r, _) in self._waiting.items() if sequence > r.after])

    def take_overdue(self, now: float) -> list[tuple[bytes, Next]]:
        """Remove and return the requests whose deadline is over."""
        return self._remove([c for c, (_, deadline) in self._waiting.items() if now >= deadline])

    def _remove(self, clients: list[bytes]) -> list[tuple[bytes, Next]]:
        return [(client, self._waiting.pop(client)[0]) for client in clients]

    def next_event(self) -> float:
        """When something is due at the latest [s, monotonic]."""
        times = [deadline for _, deadline in self._waiting.values()]
        if self._newest is not None:
            times.append(self._due)
        return min(times, default=float("inf"))
