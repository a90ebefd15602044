"""What a server remembers of its clients."""

from __future__ import annotations

import time
from collections import OrderedDict
from dataclasses import dataclass

from simgl_bridge.free_run import OWNER_SILENCE

# Clients remembered; the ones longest silent go first.
MOST_SESSIONS = 256


@dataclass
class Session:
    """name : that the client gave itself; last_tai_ns : of its last picture, None before one."""

    name: str = ""
    last_tai_ns: int | None = None
    heard: float = 0.0


class Sessions:
    """Clients by identity, the one heard of last at the end."""

    def __init__(self) -> None:
        self._known: OrderedDict[bytes, Session] = OrderedDict()

    def heard(self, client: bytes) -> Session:
        """The session of a client that has just spoken."""
        session = self._known.setdefault(client, Session())
        session.heard = time.monotonic()
        self._known.move_to_end(client)
        if len(self._known) > MOST_SESSIONS:
            self._known.popitem(last=False)
        return session

    def name(self, client: bytes) -> str:
        """What a client that is here calls itself."""
        return self._known[client].name

    def is_here(self, client: bytes) -> bool:
        """Whether a client was heard of lately and has not left."""
        session = self._known.get(client)
        return session is not None and time.monotonic() - session.heard < OWNER_SILENCE

    def here(self) -> list[bytes]:
        """The clients heard of lately."""
        return [client for client in self._known if self.is_here(client)]

    def forget(self, client: bytes) -> None:
        """Drop what is known of a client that left."""
        self._known.pop(client, None)
