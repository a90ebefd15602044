"""The connection to 42: messages one by one, each acknowledged when its work is done."""

from __future__ import annotations

import socket
import time
from select import select

from simgl.errors import BridgeError
from simgl_bridge.from_42.state_message import ENDS, StateMessage, parse_state
from simgl_bridge.server import Stop

# 42 writes at most this many bytes in a message.
_MAX_MESSAGE = 16384
_ACKNOWLEDGEMENT = b"Ack\0"
# Between two attempts to connect, and between two looks at a request to stop [s].
_PAUSE = 0.1


class TextSocket:
    """A connection to a socket where 42 serves its state (modes TX, SERVER).

    42 waits for ``acknowledge`` after each message: it does not step before.

    host, port : of ``Inp_IPC.txt``
    patience_s : for 42 to start, and for each message; 42 may be paused by its user
    stop : ends a wait
    """

    def __init__(self, host: str, port: int, patience_s: float, stop: Stop) -> None:
        self.address = f"{host}:{port}"
        self._patience_s = patience_s
        self._stop = stop
        self._received = b""
        self._socket = self._connect(host, port)

    @property
    def is_stopped(self) -> bool:
        """Whether the wait is to end."""
        return self._stop.is_set()

    def _connect(self, host: str, port: int) -> socket.socket:
        deadline = time.monotonic() + self._patience_s
        while True:
            try:
                connection = socket.create_connection((host, port), timeout=_PAUSE)
                connection.setblocking(False)
                return connection
            except OSError as error:
                if time.monotonic() + _PAUSE > deadline or self.is_stopped:
                    problem = f"42 does not answer within {self._patience_s:g} s"
                    raise BridgeError(f"{self.address}: {problem} ({error})") from None
                time.sleep(_PAUSE)

    def next_state(self) -> StateMessage | None:
        """The next message; None where 42 has closed the connection, or ``stop`` is set.

        Raises BridgeError for a message that is malformed or too long, or that does not come.
        """
        deadline = time.monotonic() + self._patience_s
        while (message := self._take_message()) is None:
            if len(self._received) > _MAX_MESSAGE:
                problem = f"a message of more than {_MAX_MESSAGE} bytes; is this 42?"
                raise BridgeError(f"{self.address}: {problem}")
            if self.is_stopped:
                return None
            if select([self._socket], [], [], _PAUSE)[0]:
                if not (received := self._receive()):
                    return None
                self._received += received
            elif time.monotonic() > deadline:
                problem = f"42 sent nothing for {self._patience_s:g} s"
                raise BridgeError(f"{self.address}: {problem}")
        return parse_state(message)

    def _receive(self) -> bytes:
        """What has arrived; nothing where 42 has ended, in whatever way."""
        try:
            return self._socket.recv(_MAX_MESSAGE)
        except OSError:
            return b""

    def _take_message(self) -> bytes | None:
        """A message that has arrived to its end, without its end line."""
        position = 0
        while (line_end := self._received.find(b"\n", position)) >= 0:
            if self._received[position:line_end].strip() in ENDS:
                message, self._received = (
                    self._received[:position],
                    self._received[line_end + 1 :],
                )
                return message
            position = line_end + 1
        return None

    def acknowledge(self) -> None:
        """Let 42 go on."""
        try:
            self._socket.sendall(_ACKNOWLEDGEMENT)
        except OSError:
            # 42 has ended; the next message says so.
            return

    def close(self) -> None:
        """Disconnect."""
        self._socket.close()

    def __enter__(self) -> TextSocket:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
