"""The last replies, kept so that a request sent twice is answered twice and rendered once."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass

from simgl_bridge.framing import BadMessageError
from simgl_bridge.messages import ErrorCode

# A client repeats at most what its window of 2 holds; no client takes the room of another.
MOST_OF_A_CLIENT = 4
MOST_REPLIES = 64
# 24 pictures of 1280 x 960 with all products, or 200 with digital numbers alone.
MOST_BYTES = 512 * 1024 * 1024

Frames = Sequence[bytes | memoryview]


@dataclass(frozen=True)
class _Kept:
    request: bytes
    frames: Frames
    size: int


class ReplyCache:
    """Replies by client identity and request id; the ones longest unused go first."""

    def __init__(self) -> None:
        self._kept: OrderedDict[tuple[bytes, int], _Kept] = OrderedDict()
        self._size = 0

    def find(self, client: bytes, id: int, request: bytes) -> Frames | None:
        """The reply to this very request; raises BadMessageError where the id had other content."""
        kept = self._kept.get((client, id))
        if kept is None:
            return None
        if kept.request != request:
            problem = f"{id} was used for another request; every new request needs a new id"
            raise BadMessageError(ErrorCode.BAD_VALUE, "id", problem, id)
        self._kept.move_to_end((client, id))
        return kept.frames

    def keep(self, client: bytes, id: int, request: bytes, frames: Frames) -> None:
        """Remember a reply."""
        size = sum(memoryview(f).nbytes for f in frames)
        self._kept[client, id] = _Kept(request, frames, size)
        self._size += size
        own = [key for key in self._kept if key[0] == client]
        if len(own) > MOST_OF_A_CLIENT:
            self._drop(own[0])
        while len(self._kept) > 1 and (len(self._kept) > MOST_REPLIES or self._size > MOST_BYTES):
            self._drop(next(iter(self._kept)))

    def forget(self, client: bytes) -> None:
        """Drop what is kept for a client."""
        for key in [k for k in self._kept if k[0] == client]:
            self._drop(key)

    def _drop(self, key: tuple[bytes, int]) -> None:
        self._size -= self._kept.pop(key).size
