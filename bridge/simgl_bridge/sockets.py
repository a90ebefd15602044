"""Client sockets, and multipart messages to and from a socket of either side without waiting."""

from __future__ import annotations

import uuid
from collections.abc import Sequence
from typing import Any

import zmq

from simgl.errors import BridgeError
from simgl_bridge.access import ClientKeys, reason
from simgl_bridge.bind_address import is_ipv6, is_loopback

HANDSHAKE_FAILURES = (
    zmq.EVENT_HANDSHAKE_FAILED_AUTH
    | zmq.EVENT_HANDSHAKE_FAILED_PROTOCOL
    | zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL
)
# The largest plane: radiance of 16384 x 16384 pixels.
LARGEST_FRAME = 16384 * 16384 * 16
# Receive buffer on the loopback. The system would begin with a quarter and grow it until images no
# longer fit the processor's cache; another network needs that.
LOOPBACK_RECEIVE_BUFFER = 512 * 1024
# Requests and replies that may wait; the server's window is smaller.
QUEUE = 8

_EVENTS = zmq.EVENT_HANDSHAKE_SUCCEEDED | zmq.EVENT_DISCONNECTED | HANDSHAKE_FAILURES

_LAST = int(zmq.NOBLOCK)
_MORE = int(zmq.NOBLOCK | zmq.SNDMORE)
# Shorter frames are copied. ZeroMQ sends longer ones from where they are, so they must not be
# written to until it is done with them.
_SHORT = 65536


def connect(
    context: zmq.Context[Any], address: str, name: str, keys: ClientKeys | None
) -> tuple[Any, Any]:
    """A DEALER socket that connects to a server, and the monitor of its connection.

    Both are of the context's kind, such as those of ``zmq.asyncio``.

    Raises BridgeError for a malformed address, and ConfigError for files that hold no keys.
    """
    socket = context.socket(zmq.DEALER)
    # Not ZMQ_IMMEDIATE, which would report a missing server sooner: with it a reply that came just
    # before a disconnection is dropped unread.
    # Two clients of one name must not take over each other's identity.
    socket.setsockopt(zmq.IDENTITY, f"{uuid.uuid4().hex}-{name[:32]}".encode()[:255])
    socket.setsockopt(zmq.LINGER, 0)
    socket.setsockopt(zmq.MAXMSGSIZE, LARGEST_FRAME)
    socket.setsockopt(zmq.SNDHWM, QUEUE)
    socket.setsockopt(zmq.RCVHWM, QUEUE)
    socket.setsockopt(zmq.RECONNECT_IVL, 50)
    socket.setsockopt(zmq.HEARTBEAT_IVL, 1000)
    socket.setsockopt(zmq.HEARTBEAT_TIMEOUT, 10_000)
    if is_loopback(address):
        socket.setsockopt(zmq.RCVBUF, LOOPBACK_RECEIVE_BUFFER)
    if is_ipv6(address):
        socket.setsockopt(zmq.IPV6, 1)
    if keys is not None:
        keys.apply(socket)
    try:
        monitor = socket.get_monitor_socket(_EVENTS)
        socket.connect(address)
    except zmq.ZMQError as error:
        raise BridgeError(f"{address}: is not an address ({reason(error)})") from None
    return socket, monitor


# In place of pyzmq's recv_multipart and send_multipart, which repeat checks for each frame and take
# twice the time.


def receive(socket: zmq.Socket[Any]) -> list[zmq.Frame]:
    """The frames of the next message; empty where no message waits."""
    try:
        frame = socket.recv(_LAST, copy=False)
    except zmq.Again:
        return []
    frames = [frame]
    while frame.more:
        frame = socket.recv(_LAST, copy=False)
        frames.append(frame)
    return frames


def send(socket: zmq.Socket[Any], frames: Sequence[bytes | memoryview]) -> None:
    """Send a message; raises zmq.Again where the queue is full."""
    *first, last = frames
    for frame in first:
        socket.send(frame, _MORE, copy=len(frame) < _SHORT)
    socket.send(last, _LAST, copy=len(last) < _SHORT)
