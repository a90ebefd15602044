"""ZMTP 3.0 by hand: what a broken or hostile program may put on the wire below ZeroMQ's API."""

from __future__ import annotations

import socket
import struct
import time

from tests.patience import limit

_GREETING = b"\xff" + bytes(8) + b"\x7f" + b"\x03\x00" + b"NULL".ljust(20, b"\0") + bytes(32)


# A message without content, and a heartbeat.
EMPTY = b"\x00\x00"
PING = b"\x04\x07\x04PING\x00\x00"


class Wire:
    """A TCP connection that has shaken hands as a DEALER socket without security."""

    def __init__(self, address: str, room: int | None = None) -> None:
        """Connect; ``room`` is for bytes that arrive and lie unread, about."""
        host, _, port = address.removeprefix("tcp://").rpartition(":")
        self._socket = socket.socket()
        self._socket.settimeout(limit(5.0))
        if room is not None:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, room)
        self._socket.connect((host, int(port)))
        self._socket.sendall(_GREETING)
        ready = b"\x05READY" + _property(b"Socket-Type", b"DEALER") + _property(b"Identity", b"")
        self._socket.sendall(b"\x04" + bytes([len(ready)]) + ready)
        # The server's greeting and READY: not needed, only waited for.
        received = b""
        while len(received) < 64 + 2 or len(received) < 66 + received[65]:
            received += self._socket.recv(1024)

    def frame(self, content: bytes, *, more: bool) -> None:
        """Send one frame of a message."""
        self.announce(len(content), more=more)
        self._socket.sendall(content)

    def announce(self, size: int, *, more: bool) -> None:
        """Send the head of a frame of any size, and nothing of it."""
        self._socket.sendall(bytes([2 | more]) + struct.pack(">Q", size))

    def raw(self, content: bytes) -> None:
        """Send bytes as they are."""
        self._socket.sendall(content)

    def is_hung_up(self) -> bool:
        """Whether the server closes the connection within five seconds."""
        deadline = time.monotonic() + limit(5.0)
        try:
            # What it still sends meanwhile is no answer.
            while (left := deadline - time.monotonic()) > 0.0:
                self._socket.settimeout(left)
                if not self._socket.recv(65536):
                    return True
        except ConnectionResetError:
            return True
        except TimeoutError:
            return False
        return False

    def reset(self) -> None:
        """Break the connection, as the end of a process does whose replies lie unread."""
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self._socket.close()

    def close(self) -> None:
        """Hang up in the middle of whatever it is."""
        self._socket.close()


def _property(name: bytes, value: bytes) -> bytes:
    return bytes([len(name)]) + name + struct.pack(">I", len(value)) + value


def ask_by_zmtp_2(address: str, header: bytes) -> bytes:
    """What a DEALER socket of a library before ZMTP 3.0 receives in answer to a header.

    Its greeting ends with the kind of the socket and an empty identity; no message has properties.
    """
    host, _, port = address.removeprefix("tcp://").rpartition(":")
    with socket.create_connection((host, int(port)), limit(5.0)) as connection:
        connection.sendall(b"\xff" + bytes(7) + b"\x01\x7f\x01\x05" + b"\x00\x00")
        connection.sendall(b"\x01\x07simgl/1" + bytes([0, len(header)]) + header)
        received = b""
        # The server's own greeting is no answer.
        while b"simgl/1" not in received[:-8]:
            more = connection.recv(65536)
            assert more, "the server hung up"
            received += more
    return received.partition(b"simgl/1")[2]
