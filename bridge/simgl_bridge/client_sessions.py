"""What a server remembers of its clients: who they are, and their last replies."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass

from simgl.lru_cache import LruCache
from simgl_bridge.framing import BadMessageError
from simgl_bridge.messages import ErrorCode

# A client that is silent for this long has left [s].
OWNER_SILENCE = 10.0
# Clients remembered; the ones silent for longest are dropped first.
MAX_SESSIONS = 256
# A client repeats at most the requests of its window of 2; no client takes the place of another.
MAX_REPLIES_PER_CLIENT = 4
MAX_REPLIES = 64
# 24 images of 1280 x 960 with all products, or 200 with DN alone.
MAX_REPLY_BYTES = 512 * 1024 * 1024

Frames = Sequence[bytes | memoryview]


@dataclass
class ClientSession:
    """A client that was heard of.

    name : that the client gave itself
    last_tai_ns : of its last image; None before the first
    last_heard : [s, monotonic]
    """

    client: bytes
    name: str = ""
    last_tai_ns: int | None = None
    last_heard: float = 0.0

    @property
    def is_present(self) -> bool:
        """Whether the client was heard of lately."""
        return time.monotonic() - self.last_heard < OWNER_SILENCE


class ClientSessions:
    """Sessions by client identity."""

    def __init__(self) -> None:
        self._sessions: LruCache[bytes, ClientSession] = LruCache(MAX_SESSIONS)

    def heard(self, client: bytes) -> ClientSession:
        """The session of a client that has just sent a message."""
        session = self._sessions.get(client, lambda: ClientSession(client))
        session.last_heard = time.monotonic()
        return session

    def present(self, client: bytes) -> ClientSession | None:
        """The session of a client that was heard of lately and has not left, or None."""
        session = self._sessions.find(client)
        return session if session is not None and session.is_present else None

    def all_present(self) -> list[bytes]:
        """The clients heard of lately."""
        return [session.client for session in self._sessions.values() if session.is_present]

    def forget(self, client: bytes) -> None:
        """Drop the session of a client that left."""
        self._sessions.pop(client)


@dataclass(frozen=True)
class _Reply:
    request: bytes
    frames: Frames
    size: int


class ReplyCache:
    """The last replies, so that a request sent twice is answered twice and rendered once.

    By client identity and request id; the ones unused for longest are dropped first.
    """

    def __init__(self) -> None:
        self._replies: OrderedDict[tuple[bytes, int], _Reply] = OrderedDict()
        self._size = 0

    def find(self, client: bytes, id: int, request: bytes) -> Frames | None:
        """The reply to this very request; raises BadMessageError where the id had other content."""
        reply = self._replies.get((client, id))
        if reply is None:
            return None
        if reply.request != request:
            problem = f"{id} was used for another request; every new request needs a new id"
            raise BadMessageError(ErrorCode.BAD_VALUE, "id", problem, id)
        self._replies.move_to_end((client, id))
        return reply.frames

    def store(self, client: bytes, id: int, request: bytes, frames: Frames) -> None:
        """Remember a reply."""
        size = sum(memoryview(f).nbytes for f in frames)
        self._replies[client, id] = _Reply(request, frames, size)
        self._size += size
        of_client = [key for key in self._replies if key[0] == client]
        if len(of_client) > MAX_REPLIES_PER_CLIENT:
            self._drop(of_client[0])
        while len(self._replies) > 1 and (
            len(self._replies) > MAX_REPLIES or self._size > MAX_REPLY_BYTES
        ):
            self._drop(next(iter(self._replies)))

    def forget(self, client: bytes) -> None:
        """Drop the replies to a client."""
        for key in [key for key in self._replies if key[0] == client]:
            self._drop(key)

    def _drop(self, key: tuple[bytes, int]) -> None:
        self._size -= self._replies.pop(key).size
