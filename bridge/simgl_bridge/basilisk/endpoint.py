"""The front for Basilisk: requests of its vizInterface become images, or say that there is none.

Basilisk asks with REQ sockets, waits without a deadline, and ends its run at any reply that it does
not know. So every request gets a reply of the form it expects, whatever went wrong here: an image
that cannot be made is one of length zero, which Basilisk marks as invalid before it goes on.
"""

from __future__ import annotations

import re
import struct
import sys
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import zmq

from simgl.errors import SimglError
from simgl_bridge.access import ANY_LOCAL, bound
from simgl_bridge.basilisk.camera_overrides import DEFAULT_OVERRIDES, CameraOverrides
from simgl_bridge.basilisk.camera_png import png_of
from simgl_bridge.basilisk.viz_messages import UnreadableError, Update, read_update
from simgl_bridge.basilisk.viz_scene import check_base
from simgl_bridge.fair_queue import FairQueue
from simgl_bridge.render_session import RenderSession
from simgl_bridge.server import report_failure

DEFAULT_ADDRESS = "tcp://127.0.0.1:5556"
# A state has some kilobytes; ZeroMQ drops who sends a longer frame.
LARGEST_FRAME = 4 * 1024 * 1024
# Peers remembered; the ones longest silent go first.
MOST_PEERS = 64
# Images kept: every camera of a state is asked for twice where vizInterface is registered twice.
MOST_KEPT = 16
# Different remarks; those after them are left out.
MOST_REMARKS = 1000
# Messages taken in between two pictures.
_MOST_AT_ONCE = 256

_IMAGE = re.compile(rb"REQUEST_IMAGE_(-?\d{1,19})")

Key = tuple[int, Update]


@dataclass
class _Peer:
    """state : the last one sent; None before it, or where it could not be read."""

    state: Update | None = None


class Remarks:
    """Lines for the person at the server, each once."""

    def __init__(self) -> None:
        self._said: set[str] = set()

    def __call__(self, line: str) -> None:
        """Say a line to stderr, unless it has been said."""
        if line in self._said or len(self._said) >= MOST_REMARKS:
            return
        self._said.add(line)
        try:
            print(f"simgl: basilisk: {line}", file=sys.stderr, flush=True)
        except OSError:
            return


class BasiliskEndpoint:
    """Answers the vizInterface of Basilisk at an address.

    studio : its scenario has the Earth, the Sun's light, and models by spacecraft names
    turns : where pictures wait, beside those of other fronts
    sheets : what the wire does not say about cameras, by camera id

    Raises ConfigError for an address open to strangers or a scenario that fixes the Sun by hand,
    and BridgeError where the address cannot be bound.
    """

    def __init__(
        self,
        render_session: RenderSession,
        queue: FairQueue,
        address: str = DEFAULT_ADDRESS,
        *,
        sheets: Mapping[int, CameraOverrides] | None = None,
    ) -> None:
        check_base(render_session.scenario)
        self._render_session = render_session
        self._queue = queue
        self._sheets = dict(sheets or {})
        self._say = Remarks()
        self._peers: OrderedDict[bytes, _Peer] = OrderedDict()
        self._kept: OrderedDict[Key, bytes] = OrderedDict()
        self._context: zmq.Context[Any] = zmq.Context()
        try:
            self.socket = self._context.socket(zmq.ROUTER)
            self.socket.setsockopt(zmq.LINGER, 0)
            self.socket.setsockopt(zmq.MAXMSGSIZE, LARGEST_FRAME)
            self.address = bound(self.socket, address, ANY_LOCAL, "--basilisk")
        except BaseException:
            self._context.destroy(linger=0)
            raise

    @property
    def summary(self) -> str:
        """One line: where, and which cameras have files."""
        files = ", ".join(f"{i} {s.where}" for i, s in self._sheets.items()) or "none"
        return (
            f"simgl is the image source of Basilisk at {self.address} "
            f"on {self._render_session.renderer_name}; camera files: {files}"
        )

    def receive(self) -> None:
        """Take in what has arrived; all but images is answered at once."""
        for _ in range(_MOST_AT_ONCE):
            try:
                client, *rest = self.socket.recv_multipart(zmq.NOBLOCK)
            except zmq.Again:
                return
            # REQ puts an empty frame before its own; a peer of another kind expects no answer.
            if not rest or rest[0] or len(rest) < 2:
                self._say(f"a peer that is no REQ socket sent {len(rest)} frames; not answered")
                continue
            self._request(client, rest[1:])

    def tick(self, now: float) -> float:  # noqa: ARG002 - silence is no fault here
        """Nothing is ever due: Basilisk may be silent for hours."""
        return float("inf")

    def farewell(self) -> None:
        """Basilisk knows no word for it."""

    def _request(self, client: bytes, frames: list[bytes]) -> None:
        peer = self._peers.setdefault(client, _Peer())
        self._peers.move_to_end(client)
        if len(self._peers) > MOST_PEERS:
            gone, _ = self._peers.popitem(last=False)
            self._queue.drop(gone)
        word = frames[0]
        if word == b"PING":
            self._reply(client, b"PONG")
        elif word == b"SIM_UPDATE":
            self._update(peer, frames)
            # Any other word ends the run.
            self._reply(client, b"OK")
        elif word == b"REQUEST_INPUT":
            self._reply(client, b"VIZARD_INPUT", self._input(peer))
        elif match := _IMAGE.fullmatch(word):
            self._enqueue(client, peer, int(match[1]))
        elif word.startswith(b"REQUEST_IMAGE"):
            self._say(f"cannot tell the camera of {word[:60]!r}")
            self._image(client, b"")
        else:
            self._say(f"knows no request {word[:60]!r}")
            self._reply(client, b"OK")

    def _update(self, peer: _Peer, frames: list[bytes]) -> None:
        before, peer.state = peer.state, None
        if len(frames) != 4:
            self._say(f"SIM_UPDATE has {len(frames)} frames, not 4; its images are empty")
            return
        try:
            state = read_update(frames[3])
        except UnreadableError as error:
            self._say(f"cannot read SIM_UPDATE: {error}; its images are empty")
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
        """A VizInput with field 1, the frame number, alone."""
        number = 0 if peer.state is None else peer.state.instant.frame_number
        return b"\x08" + varint(number)

    def _enqueue(self, client: bytes, peer: _Peer, camera_id: int) -> None:
        state = peer.state
        if state is None:
            self._say(f"camera {camera_id}: no state came before the request; its image is empty")
            self._image(client, b"")
            return
        key = (camera_id, state)
        if key in self._kept:
            self._image(client, self._kept[key])
            return
        if not self._queue.offer(client, 0, lambda: self._image(client, self._taken(key))):
            self._image(client, b"")

    def _taken(self, key: Key) -> bytes:
        """The image of a camera and a state; empty where there is none."""
        if key in self._kept:
            return self._kept[key]
        try:
            png = self.picture(*key)
        except SimglError as error:
            self._say(f"no image: {error}")
            return b""
        # Nothing here may end a run there.
        except Exception:
            report_failure()
            return b""
        self._kept[key] = png
        if len(self._kept) > MOST_KEPT:
            self._kept.popitem(last=False)
        return png

    def picture(self, camera_id: int, update: Update) -> bytes:
        """PNG of what a camera sees of a state. Raises SimglError where it sees nothing."""
        overrides = self._sheets.get(camera_id)
        if overrides is None:
            self._say(f"camera {camera_id} has no file: its lens and detector are the defaults")
            overrides = DEFAULT_OVERRIDES
        return png_of(self._render_session, update, camera_id, overrides, self._say)

    def _image(self, client: bytes, png: bytes) -> None:
        self._reply(client, struct.pack(">i", len(png)), png)

    def _reply(self, client: bytes, *frames: bytes) -> None:
        try:
            self.socket.send_multipart([client, b"", *frames], zmq.NOBLOCK)
        except zmq.Again:
            self._say("a peer takes no replies; one is lost")

    def close(self) -> None:
        """Hang up, replies in hand first."""
        self._context.destroy(linger=2000)

    def __enter__(self) -> BasiliskEndpoint:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def varint(value: int) -> bytes:
    """A number as protobuf writes it; negative ones as 64-bit two's complement."""
    value &= 2**64 - 1
    out = bytearray()
    while value >= 0x80:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)
