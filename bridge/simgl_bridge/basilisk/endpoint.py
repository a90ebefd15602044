"""The endpoint for Basilisk: answers the image requests of its vizInterface.

Basilisk asks with REQ sockets, waits without a deadline, and ends its run at an unknown reply. So
every request gets a reply of the expected form: an image that cannot be rendered has length zero,
which Basilisk marks as invalid before it goes on.
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass, replace
from typing import Any

import zmq

from simgl.lru_cache import LruCache
from simgl_bridge.access import ANY_LOCAL, bind
from simgl_bridge.basilisk.viz_messages import UnreadableError, Update, read_update
from simgl_bridge.bind_address import DEFAULT_BASILISK_ADDRESS
from simgl_bridge.messages import Error
from simgl_bridge.operator_log import OperatorLog
from simgl_bridge.render_queue import RenderQueue
from simgl_bridge.renderer_link import Payload
from simgl_bridge.renderer_messages import Answer, DrawForBasilisk, Task
from simgl_bridge.server import Work

# A state has some kilobytes; ZeroMQ drops who sends a longer frame.
LARGEST_FRAME = 4 * 1024 * 1024
# Peers remembered; the ones silent for longest are dropped.
MAX_PEERS = 64
# Images cached: a vizInterface that is registered twice asks for every image twice.
MAX_IMAGES, MAX_IMAGE_BYTES = 4096, 256 << 20
# Messages received between two images.
_MAX_PER_TURN = 256

# Basilisk's ids have 64 bits.
_IMAGE = re.compile(rb"REQUEST_IMAGE_(-?\d{1,18})")

# Kinds of warnings.
_BAD_FRAMES, _UNREADABLE, _UNKNOWN = "bad frames", "unreadable states", "unknown requests"
_NO_STATE, _NO_IMAGE, _LOST = "requests without a state", "states without an image", "lost replies"

Key = tuple[int, Update]


@dataclass
class _Peer:
    """What is known of a peer.

    state : the last one sent; None before it, or where it could not be read
    waits_for_pong : it pinged before the renderer was ready
    """

    identity: bytes
    state: Update | None = None
    waits_for_pong: bool = False


class BasiliskEndpoint:
    """Answers the vizInterface of Basilisk at an address.

    A first ping is answered once the renderer is ready: Basilisk waits for that without a deadline.

    queue : of image requests, shared with other endpoints

    Raises ConfigError for an address open to strangers, and BridgeError where it cannot be bound.
    """

    def __init__(self, queue: RenderQueue, address: str = DEFAULT_BASILISK_ADDRESS) -> None:
        self._queue = queue
        self._warn = OperatorLog("simgl: basilisk")
        self._peers: LruCache[bytes, _Peer] = LruCache(
            MAX_PEERS, lambda peer: queue.drop(peer.identity)
        )
        self._images: LruCache[Key, bytes] = LruCache(MAX_IMAGES, max_bytes=MAX_IMAGE_BYTES)
        self._context: zmq.Context[Any] = zmq.Context()
        try:
            self.socket = self._context.socket(zmq.ROUTER)
            self.socket.setsockopt(zmq.LINGER, 0)
            self.socket.setsockopt(zmq.MAXMSGSIZE, LARGEST_FRAME)
            self.address = bind(self.socket, address, ANY_LOCAL, "--basilisk")
        except BaseException:
            self._context.destroy(linger=0)
            raise

    @property
    def summary(self) -> str:
        """One line: where, and which cameras have files."""
        scene = self._queue.scene
        assert scene is not None
        return (
            f"simgl is the image source of Basilisk at {self.address} "
            f"on {scene.renderer}; camera files: {scene.camera_files}"
        )

    def receive(self) -> None:
        """Receive what has arrived; everything but image requests is answered at once."""
        for _ in range(_MAX_PER_TURN):
            try:
                client, *rest = self.socket.recv_multipart(zmq.NOBLOCK)
            except zmq.Again:
                return
            # REQ puts an empty frame before its own; a peer of another kind expects no answer.
            if not rest or rest[0] or len(rest) < 2:
                self._warn(
                    f"a peer that is not a REQ socket sent {len(rest)} frames; not answered",
                    _BAD_FRAMES,
                )
                continue
            self._request(client, rest[1:])

    def update(self, now: float) -> float:  # noqa: ARG002 - of the protocol
        """Answer early pings; otherwise never due: Basilisk may be silent for hours."""
        if self._queue.scene is not None:
            for peer in self._peers.values():
                if peer.waits_for_pong:
                    peer.waits_for_pong = False
                    self._reply(peer.identity, b"PONG")
        return float("inf")

    def farewell(self) -> None:
        """Basilisk has no message for it."""

    def _request(self, client: bytes, frames: list[bytes]) -> None:
        peer = self._peers.get(client, lambda: _Peer(client))
        command = frames[0]
        if command == b"PING":
            if self._queue.scene is None:
                peer.waits_for_pong = True
            else:
                self._reply(client, b"PONG")
        elif command == b"SIM_UPDATE":
            self._update(peer, frames)
            # Any other reply ends the run.
            self._reply(client, b"OK")
        elif command == b"REQUEST_INPUT":
            self._reply(client, b"VIZARD_INPUT", self._input(peer))
        elif match := _IMAGE.fullmatch(command):
            self._enqueue(client, peer, int(match[1]))
        elif command.startswith(b"REQUEST_IMAGE"):
            self._warn(f"cannot tell the camera of {command[:60]!r}", _UNKNOWN)
            self._send_image(client, b"")
        else:
            self._warn(f"knows no request {command[:60]!r}", _UNKNOWN)
            self._reply(client, b"OK")

    def _update(self, peer: _Peer, frames: list[bytes]) -> None:
        before, peer.state = peer.state, None
        if len(frames) != 4:
            self._warn(
                f"SIM_UPDATE has {len(frames)} frames, not 4; its images are empty", _BAD_FRAMES
            )
            return
        try:
            state = read_update(frames[3])
        except UnreadableError as error:
            self._warn(f"cannot read SIM_UPDATE: {error}; its images are empty", _UNREADABLE)
            return
        if before is not None:
            # Sent with the first messages only.
            state = replace(
                state,
                epoch=state.epoch or before.epoch,
                settings=state.settings or before.settings,
            )
        peer.state = state

    def _input(self, peer: _Peer) -> bytes:
        """A VizInput with its field 1, the frame number."""
        number = 0 if peer.state is None else peer.state.instant.frame_number
        return b"\x08" + varint(number)

    def _enqueue(self, client: bytes, peer: _Peer, camera_id: int) -> None:
        state = peer.state
        if state is None:
            problem = "no state came before the request; its image is empty"
            self._warn(f"camera {camera_id}: {problem}", _NO_STATE)
            self._send_image(client, b"")
            return
        key = (camera_id, state)
        if self._send_cached(client, key):
            return

        def begin() -> Task | None:
            # Another peer may have asked for it meanwhile.
            if self._send_cached(client, key):
                return None
            return DrawForBasilisk(camera_id=camera_id, state=state)

        def finish(answer: Answer, payload: Payload, late: bool) -> None:
            del late
            if isinstance(answer, Error):
                self._warn(f"no image: {answer.detail}", _NO_IMAGE)
            png = payload[0].tobytes() if payload else b""
            if png:
                self._images.put(key, png, len(png))
            self._send_image(client, png)

        if not self._queue.offer(client, Work(begin=begin, finish=finish)):
            self._send_image(client, b"")

    def _send_cached(self, client: bytes, key: Key) -> bool:
        """Send an image that was rendered before, if it was."""
        png = self._images.find(key)
        if png is None:
            return False
        self._send_image(client, png)
        return True

    def _send_image(self, client: bytes, png: bytes) -> None:
        self._reply(client, struct.pack(">i", len(png)), png)

    def _reply(self, client: bytes, *frames: bytes) -> None:
        try:
            self.socket.send_multipart([client, b"", *frames], zmq.NOBLOCK)
        except zmq.Again:
            self._warn("a peer takes no replies; one is lost", _LOST)

    def close(self) -> None:
        """Close the socket once pending replies are sent."""
        self._context.destroy(linger=2000)
        self._warn.close()

    def __enter__(self) -> BasiliskEndpoint:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def varint(value: int) -> bytes:
    """A protobuf varint; negative numbers as 64-bit two's complement."""
    value &= 2**64 - 1
    out = bytearray()
    while value >= 0x80:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)
