"""The monitor: small preview images on a PUB socket that never waits and may drop any.

They are made while somebody follows.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import zmq

from simgl.arrays import Image8
from simgl.errors import BridgeError
from simgl_bridge.access import Access, ClientKeys, bind, reason
from simgl_bridge.framing import BadMessageError, pack, unpack_reply
from simgl_bridge.messages import Images, Preview
from simgl_bridge.renderer_messages import Drawn
from simgl_bridge.sockets import receive

# Shortest time between two previews [s].
INTERVAL = 0.1
# Wider images are subsampled by the renderer [px].
WIDEST = 640
# Previews queued for one slow subscriber.
QUEUE = 2


class Monitor:
    """Publishes a preview of the last images, ten times a second at most."""

    def __init__(self, context: zmq.Context[Any], address: str, access: Access) -> None:
        # A PUB socket that tells of the first subscription and the last one that ends.
        self._socket = context.socket(zmq.XPUB)
        self._socket.setsockopt(zmq.SNDHWM, QUEUE)
        self.address = bind(self._socket, address, access)
        self._number = 0
        self._skipped = 0
        self._due = 0.0
        self._topics = 0

    def is_due(self, now: float) -> bool:
        """Whether a preview is wanted at a time [s, monotonic], and may be published."""
        while frames := receive(self._socket):
            self._topics += {b"\x01": 1, b"\x00": -1}.get(frames[0].bytes[:1], 0)
        return self._topics > 0 and now >= self._due

    def publish(self, images: Images, drawn: Drawn, pixels: memoryview) -> None:
        """Publish the preview that came with images; without one they are counted.

        pixels : of the preview
        """
        if not drawn.preview_camera:
            self._skipped += any(p.product == "dn" for i in drawn.images for p in i.planes)
            return
        self._due = time.monotonic() + INTERVAL
        self._number += 1
        header = Preview(
            number=self._number,
            skipped=self._skipped,
            sequence=images.sequence,
            boot=images.boot,
            camera=drawn.preview_camera,
            tai_ns=images.tai_ns,
            shape=drawn.preview_shape,
        )
        self._skipped = 0
        # A PUB socket drops what does not fit a subscriber's queue; it never waits.
        self._socket.send_multipart([*pack(header), pixels], zmq.NOBLOCK)


@dataclass(frozen=True, kw_only=True, eq=False)
class PreviewImage:
    """A preview that arrived.

    pixels : (height, width, 3) uint8 sRGB
    missed : previews published since the last one that never arrived
    """

    pixels: Image8
    camera: str
    tai_ns: int
    sequence: int
    missed: int


class PreviewClient:
    """Iterates over the previews of a server's monitor.

    address : of the monitor, as given to ``simgl serve --monitor``
    timeout_s : the iteration ends when no preview arrives for so long
    keys : of this client, for a server that requires them

    Raises BridgeError for what is not an address, and for a message that is no preview.

    >>> with PreviewClient("tcp://127.0.0.1:5564") as previews:
    ...     for preview in previews:
    ...         show(preview.pixels)
    """

    def __init__(
        self, address: str, *, timeout_s: float = 10.0, keys: ClientKeys | None = None
    ) -> None:
        self._address = address
        self._timeout_ms = round(timeout_s * 1000.0)
        self._last: Preview | None = None
        self._context = zmq.Context()
        try:
            self._socket = self._context.socket(zmq.SUB)
            self._socket.setsockopt(zmq.LINGER, 0)
            self._socket.setsockopt(zmq.RCVHWM, QUEUE)
            self._socket.setsockopt(zmq.MAXMSGSIZE, WIDEST * 16384 * 3)
            if keys is not None:
                keys.apply(self._socket)
            self._socket.connect(address)
            self._socket.subscribe(b"simgl/1")
        except zmq.ZMQError as error:
            self.close()
            raise BridgeError(f"{address}: is not an address ({reason(error)})") from None

    def __iter__(self) -> Iterator[PreviewImage]:
        return self

    def __next__(self) -> PreviewImage:
        if not self._socket.poll(self._timeout_ms):
            raise StopIteration
        return self._received()

    def newest(self) -> PreviewImage | None:
        """The newest preview that has arrived since the last one, without waiting.

        None where there is none. What came before it counts as missed.
        """
        newest, missed = None, 0
        # Ten a second come at most, two are queued: this ends.
        while self._socket.poll(0):
            newest = self._received()
            missed += newest.missed + 1
        return None if newest is None else replace(newest, missed=missed - 1)

    def _received(self) -> PreviewImage:
        preview, pixels = _unpacked(self._address, self._socket.recv_multipart())
        last = self._last
        before = last.number if last and last.boot == preview.boot else preview.number - 1
        self._last = preview
        return PreviewImage(
            pixels=pixels,
            camera=preview.camera,
            tai_ns=preview.tai_ns,
            sequence=preview.sequence,
            missed=preview.number - before - 1,
        )

    def close(self) -> None:
        """Disconnect."""
        self._context.destroy(linger=0)

    def __enter__(self) -> PreviewClient:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _unpacked(address: str, frames: list[bytes]) -> tuple[Preview, Image8]:
    try:
        preview = unpack_reply(frames)
    except BadMessageError as error:
        raise BridgeError(f"{address}: the server sent an invalid message: {error}") from None
    if not isinstance(preview, Preview) or len(frames) != 3:
        raise BridgeError(f"{address}: is not a monitor")
    if min(preview.shape) < 1 or int(np.prod(preview.shape)) != len(frames[2]):
        raise BridgeError(f"{address}: a preview announces {preview.shape}, not what it brings")
    return preview, np.frombuffer(frames[2], dtype=np.uint8).reshape(preview.shape)
