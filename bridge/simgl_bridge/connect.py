"""How a client's socket comes to be: its options, its keys, and a monitor of its connection.

The synchronous client and the asynchronous one dial alike, each with sockets of its own kind.
"""

from __future__ import annotations

import uuid
from typing import Any

import zmq

from simgl.errors import BridgeError
from simgl_bridge.access import ClientKeys, reason
from simgl_bridge.bind_address import is_ipv6

# The largest plane: radiance of 16384 x 16384 pixels.
LARGEST_FRAME = 16384 * 16384 * 16
# Requests and replies that may wait; the server's window is smaller.
QUEUE = 8

# A handshake that failed, and all that a client wants to know of its connection.
FAILURES = (
    zmq.EVENT_HANDSHAKE_FAILED_AUTH
    | zmq.EVENT_HANDSHAKE_FAILED_PROTOCOL
    | zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL
)
_EVENTS = zmq.EVENT_HANDSHAKE_SUCCEEDED | zmq.EVENT_DISCONNECTED | FAILURES


def dial(
    context: zmq.Context[Any], address: str, name: str, keys: ClientKeys | None
) -> tuple[Any, Any]:
    """A DEALER socket that connects to a server, and the monitor of its connection.

    Both are of the context's kind, such as those of ``zmq.asyncio``.

    Raises BridgeError for what is no address, and ConfigError for files that hold no keys.
    """
    socket = context.socket(zmq.DEALER)
    _set_options(socket, name)
    if is_ipv6(address):
        socket.setsockopt(zmq.IPV6, 1)
    if keys is not None:
        keys.apply(socket)
    try:
        monitor = socket.get_monitor_socket(_EVENTS)
        socket.connect(address)
    except zmq.ZMQError as error:
        raise BridgeError(f"{address}: is no address ({reason(error)})") from None
    return socket, monitor


def _set_options(socket: zmq.Socket[Any], name: str) -> None:
    # Not ZMQ_IMMEDIATE, which would tell a missing server sooner: with it a reply that came just
    # before a disconnection is dropped unread.
    # Two clients of one name must not take over each other's place.
    socket.setsockopt(zmq.IDENTITY, f"{uuid.uuid4().hex}-{name[:32]}".encode()[:255])
    socket.setsockopt(zmq.LINGER, 0)
    socket.setsockopt(zmq.MAXMSGSIZE, LARGEST_FRAME)
    socket.setsockopt(zmq.SNDHWM, QUEUE)
    socket.setsockopt(zmq.RCVHWM, QUEUE)
    socket.setsockopt(zmq.RECONNECT_IVL, 50)
    socket.setsockopt(zmq.HEARTBEAT_IVL, 1000)
    socket.setsockopt(zmq.HEARTBEAT_TIMEOUT, 10_000)
