"""Two clients of one identity: a ROUTER socket serves the newer connection, and says so to neither.

What the older one sends is then lost without a word, and an image could reach the wrong one. So the
server notices over which connection a message comes, ends the connection that was taken over, and
tells whoever has the identity for a while: ZeroMQ connects the older one again, which takes the
identity back and is told too. At the end the newer one is connected again.
"""

from __future__ import annotations

import os
import socket
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import zmq
from zmq.utils.monitor import recv_monitor_message

from simgl.lru_cache import LruCache

# Clients of which the connection is remembered.
_MAX_CLIENTS = 1024
# For this long the holders of a contested identity are told [s], this often.
_TELLING_TIME = 1.5
_TELLING_INTERVAL = 0.1


@dataclass
class _Contest:
    """Two clients have one identity.

    end : of telling them [s, monotonic]
    taken_back : a client has connected since
    """

    end: float
    taken_back: bool = False


class IdentityWatch:
    """The connection of each client of a ROUTER socket, by file descriptor."""

    def __init__(self, router: zmq.Socket[Any]) -> None:
        self._router = router
        self._monitor = router.get_monitor_socket(zmq.EVENT_ACCEPTED | zmq.EVENT_DISCONNECTED)
        self._client_of: dict[int, bytes] = {}
        self._connection_of: LruCache[bytes, list[int]] = LruCache(_MAX_CLIENTS)
        self._contests: dict[bytes, _Contest] = {}
        self._tell_at = 0.0

    def is_taken_over(self, client: bytes, frame: zmq.Frame, now: float) -> bool:
        """Whether a message takes an identity over from a connection that is still open.

        Messages of a ZeroMQ library that speaks ZMTP 2.0 or older do not tell their connection:
        such clients are served, and their identities not watched.

        frame : of the message
        now : [s, monotonic]
        """
        try:
            connection = int(frame.get(zmq.SRCFD))
        except zmq.ZMQError:
            return False
        if self._client_of.get(connection) == client:
            return False
        self._read_events()
        last = self._connection_of.get(client, lambda: [connection])
        (before,), last[:] = last, [connection]
        is_open = before != connection and self._client_of.get(before) == client
        self._client_of[connection] = client
        if is_open:
            del self._client_of[before]
            _disconnect(before)
            self._contests[client] = _Contest(now + _TELLING_TIME)
        return is_open

    def contested(self, now: float) -> list[bytes]:
        """The identities whose holders are to be told now."""
        self._read_events()
        if now < self._tell_at or not self._contests:
            return []
        self._tell_at = now + _TELLING_INTERVAL
        for client in [c for c, contest in self._contests.items() if now >= contest.end]:
            if self._contests.pop(client).taken_back:
                # What the newer one sends over the connection known of it is lost.
                connection = self._connection_of.get(client, lambda: [-1])[0]
                self._client_of.pop(connection, None)
                _disconnect(connection)
        return list(self._contests)

    def _read_events(self) -> None:
        while self._monitor.poll(0):
            event = recv_monitor_message(self._monitor)
            # A new connection may have the number of one that is gone.
            self._client_of.pop(int(event["value"]), None)
            if event["event"] == zmq.EVENT_ACCEPTED:
                for contest in self._contests.values():
                    contest.taken_back = True

    def close(self) -> None:
        """Stop watching."""
        self._router.disable_monitor()


def _disconnect(connection: int) -> None:
    """End a connection of ZeroMQ's, which notices it as if the peer had."""
    with suppress(OSError), socket.socket(fileno=os.dup(connection)) as duplicate:
        duplicate.shutdown(socket.SHUT_RDWR)
