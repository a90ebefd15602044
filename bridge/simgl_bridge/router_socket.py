"""The server's socket: requests come in, replies and refusals go out, and none of it waits."""

from __future__ import annotations

import errno
from collections.abc import Callable, Iterator
from typing import Any

import zmq

from simgl_bridge import multipart
from simgl_bridge.access import Access, bound
from simgl_bridge.bind_address import is_loopback
from simgl_bridge.framing import BadMessageError, pack
from simgl_bridge.messages import Error, ErrorCode
from simgl_bridge.render_session import GpuLostError
from simgl_bridge.reply_cache import Frames
from simgl_bridge.server import report_failure

# Of a picture on its way through the loopback no more than this is between sender and receiver: it
# stays in the processor's cache, where the megabytes that the system would let pile up do not, and
# 1280 x 960 pixels arrive in half the time. A network needs what the system finds best.
LOOPBACK_BUFFER = 256 * 1024
# ZeroMQ drops a client that sends a longer frame, before it takes any memory for it.
LARGEST_FRAME = 128 * 1024
# Replies waiting for one client, as pictures of the largest camera: a reader that stalls loses what
# is beyond. ZeroMQ may take a queue for full from its half on, so it is never shorter than 16.
QUEUE_BYTES = 256 * 1024 * 1024
QUEUE_RANGE = (16, 256)
# Messages of one client that wait to be taken in: those that a fast simulation in free-run sends
# while a picture is made. Only where more come can libzmq 4.3.5 abort the process: if a heartbeat
# is among those that found no room, and the client breaks the connection (!_io_error in
# stream_engine_base.cpp).
MOST_WAITING = 1024
# Messages taken in between two pictures: a flood must not keep the others from theirs.
MOST_AT_ONCE = 256


class RouterSocket:
    """A ROUTER socket bound to an address, and what it counts.

    most_pixels : of one picture
    on_gone : told of a client whose reply found nobody

    errors : refusals sent; ``busy`` of them were BUSY
    lost : replies that could not be handed over

    Raises ConfigError for an address open to strangers and BridgeError where it cannot be bound.
    """

    def __init__(
        self,
        context: zmq.Context[Any],
        address: str,
        access: Access,
        *,
        most_pixels: int,
        on_gone: Callable[[bytes], None],
    ) -> None:
        self._on_gone = on_gone
        self.errors = self.busy = self.lost = 0
        self.socket = context.socket(zmq.ROUTER)
        self._configure(address, most_pixels)
        self.address = bound(self.socket, address, access)

    def _configure(self, address: str, most_pixels: int) -> None:
        s = self.socket
        s.setsockopt(zmq.LINGER, 0)
        if is_loopback(address):
            s.setsockopt(zmq.SNDBUF, LOOPBACK_BUFFER)
        s.setsockopt(zmq.MAXMSGSIZE, LARGEST_FRAME)
        least, most = QUEUE_RANGE
        s.setsockopt(zmq.SNDHWM, min(max(QUEUE_BYTES // (2 * most_pixels), least), most))
        s.setsockopt(zmq.RCVHWM, MOST_WAITING)
        # A client that comes back with its identity takes over at once.
        s.setsockopt(zmq.ROUTER_HANDOVER, 1)
        # A reply to a client that left is an error that can be seen, not silence.
        s.setsockopt(zmq.ROUTER_MANDATORY, 1)
        # Not ZMQ_HEARTBEAT_IVL, whose timer aborts the process in the same place. The clients send
        # heartbeats, which are answered; one that vanished is noticed by TCP.
        s.setsockopt(zmq.TCP_KEEPALIVE, 1)
        s.setsockopt(zmq.TCP_KEEPALIVE_IDLE, 10)
        s.setsockopt(zmq.TCP_KEEPALIVE_INTVL, 5)
        s.setsockopt(zmq.TCP_KEEPALIVE_CNT, 3)

    def arrived(self) -> Iterator[tuple[bytes, list[bytes]]]:
        """The messages that wait, each with the client that sent it."""
        for _ in range(MOST_AT_ONCE):
            frames = [frame.bytes for frame in multipart.receive(self.socket)]
            if not frames:
                return
            yield frames[0], frames[1:]

    def send(self, client: bytes, frames: Frames) -> None:
        """Hand a reply over; a client that left, or reads nothing, loses it."""
        try:
            multipart.send(self.socket, [client, *frames])
        except zmq.ZMQError as error:
            if error.errno not in (errno.EHOSTUNREACH, zmq.EAGAIN):
                raise
            # One that reads nothing may ask again; nothing more is rendered for one that left.
            self.lost += 1
            if error.errno == errno.EHOSTUNREACH:
                self._on_gone(client)

    def refuse(self, client: bytes, error: BadMessageError) -> None:
        """Say why a request has no other answer."""
        self.errors += 1
        self.busy += error.code == ErrorCode.BUSY
        reply = Error(
            id=error.id,
            code=error.code,
            field=error.field,
            detail=str(error),
            retryable=error.retryable,
        )
        self.send(client, pack(reply))

    def guarded(self, client: bytes, answer: Callable[[], None], id: int | None = None) -> None:
        """Answer a client; whatever goes wrong becomes a refusal."""
        try:
            answer()
        except BadMessageError as error:
            self.refuse(client, error)
        except GpuLostError as error:
            code, detail = ErrorCode.GPU_LOST, f"{error}; a new context is opened"
            self.refuse(client, BadMessageError(code, "", detail, id, retryable=True))
        # Nothing that a request sets off may end the service for the others.
        except Exception as error:
            report_failure()
            detail = " ".join(f"{type(error).__name__}: {error}".split())
            self.refuse(client, BadMessageError(ErrorCode.INTERNAL, "", detail, id))
