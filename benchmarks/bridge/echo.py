"""The floor of the loop's cost: a bare ZeroMQ socket that answers anything with an image."""

from __future__ import annotations

import signal
import sys
from threading import Event

import numpy as np
import zmq
from simgl_bridge.router_socket import LOOPBACK_BUFFER

# As long as the header of a reply with one image.
HEADER_BYTES = 800


def main() -> None:
    """``python -m benchmarks.bridge.echo WIDTH HEIGHT --address ADDRESS``.

    Sockets, number of frames and planes without a copy are as in simgl/1; nothing is decoded,
    checked or remembered.
    """
    width, height, _, address = sys.argv[1:]
    stop = Event()
    signal.signal(signal.SIGTERM, lambda *_: stop.set())
    dn = np.random.default_rng(1).integers(0, 4000, (int(height), int(width)), dtype=np.uint16)
    pixels, header = memoryview(dn.data).cast("B"), bytes(HEADER_BYTES)
    with zmq.Context() as context, context.socket(zmq.ROUTER) as socket:
        socket.linger = 0
        socket.setsockopt(zmq.SNDBUF, LOOPBACK_BUFFER)
        socket.bind(address)
        while not stop.is_set():
            if socket.poll(50):
                client, version, _ = socket.recv_multipart()
                socket.send_multipart([client, version, header, pixels], copy=False)


if __name__ == "__main__":
    main()
