"""Two clients of one identity: a ROUTER socket serves the newer connection, and says so to neither.

What the older one sends is then lost without a word, and an image could reach the wrong one. So the
server notices over which connection a message comes, ends the connection that was taken over, and
tells whoever has the identity, again and again: ZeroMQ connects the older one again, which takes
the identity back and is told too. At the end the newer one is connected again.
"""

from __future__ import annotations

import os
import socket
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, NamedTuple

import zmq
from zmq.utils.monitor import recv_monitor_message

from simgl.lru_cache import LruCache

# Clients of which the connection is remembered.
_MAX_CLIENTS = 1024
# The holder of a contested identity is told this often, this far apart [s]. Counted, so that a
# server that was held up in between tells no less.
_TELLINGS = 15
_TELLING_INTERVAL = 0.1
# At least, once a client has connected since.
_TELLINGS_TAKEN_BACK = 5


class _Connection(NamedTuple):
    """A connection of ZeroMQ's.

    number : its file descriptor, which another socket has once this one is closed
    inode : of the socket, which no other one has
    """

    number: int
    inode: int


@dataclass
class _Contest:
    """Two clients have one identity.

    tellings : still to come
    taken_back : a client has connected since
    """

    tellings: int = _TELLINGS
    taken_back: bool = False


class IdentityWatch:
    """The connection of each client of a ROUTER socket."""

    def __init__(self, router: zmq.Socket[Any]) -> None:
        self._router = router
        self._monitor = router.get_monitor_socket(zmq.EVENT_ACCEPTED | zmq.EVENT_DISCONNECTED)
        # By file descriptor.
        self._client_of: dict[int, bytes] = {}
        self._connection_of: LruCache[bytes, list[_Connection]] = LruCache(_MAX_CLIENTS)
        self._contests: dict[bytes, _Contest] = {}
        self._tell_at = 0.0

    def is_taken_over(self, client: bytes, frame: zmq.Frame) -> bool:
        """Whether a message takes an identity over from a connection that is still open.

        Messages of a ZeroMQ library that speaks ZMTP 2.0 or older do not tell their connection:
        such clients are served, and their identities not watched.

        frame : of the message
        """
        try:
            number = int(frame.get(zmq.SRCFD))
        except zmq.ZMQError:
            return False
        if self._client_of.get(number) == client:
            return False
        self._read_events()
        connection = _Connection(number, _inode(number))
        last = self._connection_of.get(client, lambda: [connection])
        (before,), last[:] = last, [connection]
        is_open = before.number != number and self._client_of.get(before.number) == client
        self._client_of[number] = client
        if is_open:
            del self._client_of[before.number]
            _disconnect(before)
            self._contests[client] = _Contest()
        return is_open

    def contested(self, now: float) -> list[bytes]:
        """The identities whose holders are to be told now.

        now : [s, monotonic]
        """
        self._read_events()
        if now < self._tell_at or not self._contests:
            return []
        self._tell_at = now + _TELLING_INTERVAL
        for client in [c for c, contest in self._contests.items() if contest.tellings == 0]:
            contest = self._contests.pop(client)
            if contest.taken_back and (last := self._connection_of.find(client)) is not None:
                # What the newer one sends over the connection known of it is lost.
                self._client_of.pop(last[0].number, None)
                _disconnect(last[0])
        for contest in self._contests.values():
            contest.tellings -= 1
        return list(self._contests)

    def _read_events(self) -> None:
        while self._monitor.poll(0):
            event = recv_monitor_message(self._monitor)
            # A new connection may have the number of one that is gone.
            self._client_of.pop(int(event["value"]), None)
            if event["event"] == zmq.EVENT_ACCEPTED:
                for contest in self._contests.values():
                    if not contest.taken_back:
                        contest.taken_back = True
                        contest.tellings = max(contest.tellings, _TELLINGS_TAKEN_BACK)

    def close(self) -> None:
        """Stop watching."""
        self._router.disable_monitor()


def _inode(number: int) -> int:
    try:
        return os.fstat(number).st_ino
    except OSError:
        return -1


def _disconnect(connection: _Connection) -> None:
    """End a connection of ZeroMQ's, which notices it as if the peer had."""
    with suppress(OSError), socket.socket(fileno=os.dup(connection.number)) as duplicate:
        # ZeroMQ may have closed it meanwhile, and its number be that of another socket.
        if _inode(duplicate.fileno()) == connection.inode:
            duplicate.shutdown(socket.SHUT_RDWR)
