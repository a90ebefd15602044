"""The endpoint for Basilisk: answers the image requests of its vizInterface.

Basilisk asks with REQ sockets, waits without a deadline, and ends its run at an unknown reply. So
every request gets a reply of the expected form: an image that cannot be rendered has length zero,
which Basilisk marks as invalid before it goes on.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import zmq

from simgl.errors import SimglError
from simgl.lru_cache import LruCache
from simgl_bridge.access import ANY_LOCAL, bind
from simgl_bridge.basilisk.camera_overrides import DEFAULT_OVERRIDES, CameraOverrides
from simgl_bridge.basilisk.camera_png import png_of
from simgl_bridge.basilisk.viz_messages import UnreadableError, Update, read_update
from simgl_bridge.basilisk.viz_scene import check_base
from simgl_bridge.operator_log import OperatorLog
from simgl_bridge.render_session import RenderSession
from simgl_bridge.server import FairQueue

DEFAULT_ADDRESS = "tcp://127.0.0.1:5556"
# A state has some kilobytes; ZeroMQ drops who sends a longer frame.
LARGEST_FRAME = 4 * 1024 * 1024
# Peers remembered; the ones silent for longest are dropped.
MAX_PEERS = 64
# Images cached: a vizInterface that is registered twice asks for every image twice.
MAX_IMAGES = 16
# Messages received between two images.
_MAX_PER_TURN = 256

_IMAGE = re.compile(rb"REQUEST_IMAGE_(-?\d{1,19})")

# Kinds of warnings.
_BAD_FRAMES, _UNREADABLE, _UNKNOWN = "bad frames", "unreadable states", "unknown requests"
_NO_STATE, _NO_IMAGE, _LOST = "requests without a state", "states without an image", "lost replies"

Key = tuple[int, Update]


@dataclass
class _Peer:
    """state : the last one sent; None before it, or where it could not be read."""

    identity: bytes
    state: Update | None = None


class BasiliskEndpoint:
    """Answers the vizInterface of Basilisk at an address.

    render_session : its scenario has the Earth, the Sun's light, and models by spacecraft names
    queue : of image requests, shared with other endpoints
    overrides : camera parameters that the wire does not carry, by camera id

    Raises ConfigError for an address open to strangers or a scenario that fixes the Sun by hand,
    and BridgeError where the address cannot be bound.
    """

    def __init__(
        self,
        render_session: RenderSession,
        queue: FairQueue,
        address: str = DEFAULT_ADDRESS,
        *,
        overrides: Mapping[int, CameraOverrides] | None = None,
    ) -> None:
        check_base(render_session.scenario)
        self._render_session = render_session
        self._queue = queue
        self._overrides = dict(overrides or {})
        self._warn = OperatorLog("simgl: basilisk")
        self._peers: LruCache[bytes, _Peer] = LruCache(
            MAX_PEERS, lambda peer: queue.drop(peer.identity)
        )
        self._images: LruCache[Key, bytes] = LruCache(MAX_IMAGES)
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
        files = ", ".join(f"{i} {s.where}" for i, s in self._overrides.items()) or "none"
        return (
            f"simgl is the image source of Basilisk at {self.address} "
            f"on {self._render_session.renderer_name}; camera files: {files}"
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
                    f"a peer that is no REQ socket sent {len(rest)} frames; not answered",
                    _BAD_FRAMES,
                )
                continue
            self._request(client, rest[1:])

    def update(self, now: float) -> float:  # noqa: ARG002 - of the protocol
        """Never due: Basilisk may be silent for hours."""
        return float("inf")

    def farewell(self) -> None:
        """Basilisk has no message for it."""

    def _request(self, client: bytes, frames: list[bytes]) -> None:
        peer = self._peers.get(client, lambda: _Peer(client))
        command = frames[0]
        if command == b"PING":
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
        if (png := self._images.find(key)) is not None:
            self._send_image(client, png)
        elif not self._queue.offer(
            client, 0, lambda: self._send_image(client, self._image_or_empty(key))
        ):
            self._send_image(client, b"")

    def _image_or_empty(self, key: Key) -> bytes:
        """The image of a camera and a state; empty where there is none."""
        try:
            return self._images.get(key, lambda: self.image(*key))
        except SimglError as error:
            self._warn(f"no image: {error}", _NO_IMAGE)
        # No failure here may end a run of Basilisk.
        except Exception:
            self._warn.failure()
        return b""

    def image(self, camera_id: int, update: Update) -> bytes:
        """PNG image of a state. Raises SimglError where there is none."""
        overrides = self._overrides.get(camera_id)
        if overrides is None:
            self._warn(f"camera {camera_id} has no file: its lens and detector are the defaults")
            overrides = DEFAULT_OVERRIDES
        return png_of(self._render_session, update, camera_id, overrides, self._warn)

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
