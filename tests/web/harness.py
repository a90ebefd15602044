"""A page server with a snapshot, and plain HTTP and WebSocket requests to it."""

from __future__ import annotations

import base64
import os
import socket
import struct
import urllib.error
import urllib.request
from pathlib import Path

import numpy as np
import numpy.typing as npt

from simgl.figures.displays import CameraImages
from simgl.web.page_server import PageServer
from simgl.web.snapshots import NewestSnapshot, Snapshot
from simgl.web.web_access import WebAccess
from tests.patience import limit
from tests.web.small_scene import box_scenario

LOCAL = WebAccess(host="127.0.0.1", port=0)


def snapshot(
    newest: NewestSnapshot, value: int = 7, size: int = 48, **planes: npt.NDArray[np.float32]
) -> Snapshot:
    """The scene with an image of noise, which JPEG does not make small, and with other planes."""
    scenario = newest.scenario
    rng = np.random.default_rng(value)
    dn = rng.integers(0, 4096, (size, size), dtype=np.uint16)
    images = CameraImages(
        camera=scenario.cameras["nav"],
        planes={"dn": dn, **planes},
        saturated_share=0.0,
        seconds=0.01,
    )
    state = scenario.at(scenario.epoch_tai_ns)
    return Snapshot(state=state, images={"nav": images})


def shown(access: WebAccess = LOCAL, patience: float = 30.0) -> tuple[NewestSnapshot, PageServer]:
    """A server of the box; close it."""
    newest = NewestSnapshot(box_scenario())
    newest.publish(snapshot(newest))
    return newest, PageServer(newest, access, patience=patience)


def got(server: PageServer, path: str, **headers: str) -> tuple[int, bytes]:
    """Status and content of a request."""
    request = urllib.request.Request(f"http://127.0.0.1:{server.port}{path}", headers=headers)
    try:
        with urllib.request.urlopen(request, timeout=limit(20.0)) as reply:
            return reply.status, reply.read()
    except urllib.error.HTTPError as error:
        with error:
            return error.code, error.read()


def stream(server: PageServer, path: str, receive_buffer: int | None = None) -> socket.socket:
    """A connection that has asked for a stream."""
    link = socket.socket()
    if receive_buffer is not None:
        link.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
    link.settimeout(limit(20.0))
    link.connect(("127.0.0.1", server.port))
    link.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode())
    return link


def next_jpeg(link: socket.socket, buffer: bytearray) -> bytes:
    """The next image of a stream; fails at its end."""
    while True:
        start = buffer.find(b"\xff\xd8")
        end = buffer.find(b"\xff\xd9\r\n", start)
        if start >= 0 and end >= 0:
            image = bytes(buffer[start : end + 2])
            del buffer[: end + 4]
            return image
        received = link.recv(65536)
        assert received, "the stream ended"
        buffer += received


class Socket:
    """A WebSocket client: as much of RFC 6455 as a test needs."""

    def __init__(self, server: PageServer, origin: str = "", path: str = "/view") -> None:
        self._link = socket.create_connection(("127.0.0.1", server.port), limit(20.0))
        origin = origin or f"http://127.0.0.1:{server.port}"
        key = base64.b64encode(os.urandom(16)).decode()
        self._link.sendall(
            f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\nUpgrade: websocket\r\n"
            f"Connection: Upgrade\r\nSec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n"
            f"Origin: {origin}\r\n\r\n".encode()
        )
        head = b""
        while not head.endswith(b"\r\n\r\n"):
            head += self._link.recv(1) or b"\r\n\r\n"
        self.status = int(head.split()[1])

    def send(self, text: str) -> None:
        """Send a short text, masked as clients must."""
        data = text.encode()
        assert len(data) < 65536
        head = struct.pack("!BBH", 0x81, 0x80 | 126, len(data))
        self._link.sendall(head + bytes(4) + data)

    def receive(self) -> tuple[int, bytes]:
        """Opcode and content of the next message; pings are answered by nothing."""
        opcode, length = self._exactly(2)
        length &= 127
        if length > 125:
            form = "!H" if length == 126 else "!Q"
            (length,) = struct.unpack(form, self._exactly(struct.calcsize(form)))
        content = self._exactly(length)
        return (opcode & 15, content) if opcode & 15 != 9 else self.receive()

    def _exactly(self, count: int) -> bytes:
        data = b""
        while len(data) < count:
            received = self._link.recv(count - len(data))
            assert received, "the connection ended"
            data += received
        return data

    def close(self) -> None:
        """Break the connection."""
        self._link.close()


def chromium() -> str | None:
    """The program, as Debian or Playwright installs it."""
    import shutil

    for name in ("chromium", "chromium-browser", "google-chrome"):
        if (path := shutil.which(name)) is not None:
            return path
    cache = Path.home() / ".cache" / "ms-playwright"
    return next((str(p) for p in sorted(cache.glob("chromium-*/chrome-linux*/chrome"))), None)
