"""The server's socket: receives requests and sends replies and refusals, without waiting."""

from __future__ import annotations

import errno
from collections.abc import Callable, Iterator
from typing import Any, TypeVar

import zmq

from simgl_bridge.access import Access, bind
from simgl_bridge.bind_address import is_loopback
from simgl_bridge.client_sessions import Frames
from simgl_bridge.framing import BadMessageError, error_of, pack, quoted
from simgl_bridge.identity_watch import IdentityWatch
from simgl_bridge.messages import Error, ErrorCode
from simgl_bridge.operator_log import OperatorLog
from simgl_bridge.sockets import receive, send

# Send buffer on the loopback: pixels under way stay in the processor's cache, so that 1280 x 960 of
# them arrive in half the time that the megabytes of the system's default take. Other networks need
# that default.
LOOPBACK_BUFFER = 256 * 1024
# ZeroMQ drops a client that sends a longer frame, before it takes any memory for it.
LARGEST_FRAME = 128 * 1024
# Replies queued for one client; one that reads nothing loses further ones. ZeroMQ may report a
# half-full queue as full. A client that waits for its replies has four at most.
QUEUE = 32
# Messages of one client that wait to be received: those that a fast simulation in free-run sends
# while an image is rendered. libzmq 4.3.5 can abort the process only where more come: if a
# heartbeat is among those that found the queue full, and the client breaks the connection
# (!_io_error in stream_engine_base.cpp).
MAX_WAITING = 1024
# Messages received between two images: a flood must not delay the other clients.
MAX_PER_TURN = 256

_Result = TypeVar("_Result")


class RouterSocket:
    """A ROUTER socket bound to an address, and what it counts.

    on_gone : called with a client that has left, when a reply to it fails

    log : of failures
    errors : refusals sent; ``busy`` of them were BUSY
    lost : replies that could not be sent

    Raises ConfigError for an address open to strangers and BridgeError where it cannot be bound.
    """

    def __init__(
        self,
        context: zmq.Context[Any],
        address: str,
        access: Access,
        *,
        on_gone: Callable[[bytes], None],
    ) -> None:
        self._on_gone = on_gone
        self.log = OperatorLog()
        self.errors = self.busy = self.lost = 0
        self.socket = context.socket(zmq.ROUTER)
        self._configure(address)
        self._identities = IdentityWatch(self.socket)
        self.address = bind(self.socket, address, access)

    def _configure(self, address: str) -> None:
        s = self.socket
        s.setsockopt(zmq.LINGER, 0)
        if is_loopback(address):
            s.setsockopt(zmq.SNDBUF, LOOPBACK_BUFFER)
        s.setsockopt(zmq.MAXMSGSIZE, LARGEST_FRAME)
        s.setsockopt(zmq.SNDHWM, QUEUE)
        s.setsockopt(zmq.RCVHWM, MAX_WAITING)
        # A client that connects again with its identity takes over at once.
        s.setsockopt(zmq.ROUTER_HANDOVER, 1)
        # A reply to a client that left raises an error.
        s.setsockopt(zmq.ROUTER_MANDATORY, 1)
        # Not ZMQ_HEARTBEAT_IVL, whose timer aborts the process in the same place. Clients send
        # heartbeats, which are answered; TCP notices a client that vanished.
        s.setsockopt(zmq.TCP_KEEPALIVE, 1)
        s.setsockopt(zmq.TCP_KEEPALIVE_IDLE, 10)
        s.setsockopt(zmq.TCP_KEEPALIVE_INTVL, 5)
        s.setsockopt(zmq.TCP_KEEPALIVE_CNT, 3)

    def arrived(self) -> Iterator[tuple[bytes, list[bytes]]]:
        """The messages that have arrived, each with the client that sent it."""
        for _ in range(MAX_PER_TURN):
            frames = receive(self.socket)
            if not frames:
                return
            client = frames[0].bytes
            if self._identities.is_taken_over(client, frames[-1]):
                # Nothing that one of the two asked for may reach the other.
                self._on_gone(client)
                self._refuse_identity(client)
            else:
                yield client, [frame.bytes for frame in frames[1:]]

    def update(self, now: float) -> None:
        """Tell clients that share an identity, one after the other as each of them has it."""
        for client in self._identities.contested(now):
            self._refuse_identity(client)

    def _refuse_identity(self, client: bytes) -> None:
        problem = f"another client uses the identity {quoted(client.decode('latin-1'))}, too; "
        problem += "every client needs its own"
        self.refuse(client, error_of(BadMessageError(ErrorCode.SHARED_IDENTITY, "", problem)))

    def close(self) -> None:
        """Before its context is destroyed."""
        self._identities.close()
        self.log.close()

    def send(self, client: bytes, frames: Frames) -> None:
        """Send a reply; a client that left, or reads nothing, loses it."""
        try:
            send(self.socket, [client, *frames])
        except zmq.ZMQError as error:
            if error.errno not in (errno.EHOSTUNREACH, zmq.EAGAIN):
                raise
            # A client that reads nothing may ask again; for one that left nothing more is rendered.
            self.lost += 1
            if error.errno == errno.EHOSTUNREACH:
                self._on_gone(client)

    def refuse(self, client: bytes, error: Error) -> None:
        """Send an Error reply."""
        self.errors += 1
        self.busy += error.code == ErrorCode.BUSY
        self.send(client, pack(error))

    def answer_or_refuse(
        self, client: bytes, answer: Callable[[], _Result], id: int | None = None
    ) -> _Result | None:
        """The result of ``answer``; whatever it raises becomes an Error reply."""
        try:
            return answer()
        except BadMessageError as error:
            self.refuse(client, error_of(error))
        # No request may end the service for the other clients.
        except Exception as error:
            self.log.failure()
            detail = f"{type(error).__name__}: {error}"
            self.refuse(client, error_of(BadMessageError(ErrorCode.INTERNAL, "", detail, id)))
        return None
