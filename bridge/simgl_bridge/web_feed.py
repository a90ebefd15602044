"""The browser view of a server: another process, which asks for the newest images.

Images are handed over without a copy, and only when it asks; what comes in between is dropped. It
asks at most ten times a second, and only while somebody looks on.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import msgspec
import zmq

from simgl.blas_threads import ONE_THREAD
from simgl.errors import BridgeError
from simgl_bridge.messages import Images, Statistics
from simgl_bridge.server import print_line
from simgl_bridge.sockets import receive, send

# The view's process, before its arguments.
_COMMAND = (sys.executable, "-m", "simgl_bridge.web_process")
# A process that was asked to end is killed after this [s].
_PATIENCE = 2.0


class WebOptions(msgspec.Struct, frozen=True, kw_only=True):
    """What the view's process opens.

    address : HOST:PORT of the page
    token_file : with the token that browsers must show; None on loopback
    """

    scenario: str
    address: str
    token_file: str | None = None


class Shown(msgspec.Struct, frozen=True, kw_only=True):
    """Images of a reply for the view; their planes follow as frames."""

    images: Images
    statistics: Statistics


SHOWN_DECODER = msgspec.msgpack.Decoder(Shown)
_ENCODER = msgspec.msgpack.Encoder()


class WebFeed:
    """Starts the view's process and hands it the newest images. Nothing here waits for it."""

    def __init__(self, options: WebOptions) -> None:
        self._newest: tuple[Shown, Sequence[memoryview]] | None = None
        self._is_asked = False
        self._was_ready = False
        self._folder = tempfile.mkdtemp(prefix="simgl-")
        self._context: zmq.Context[Any] = zmq.Context()
        self._socket = self._context.socket(zmq.PAIR)
        self._socket.setsockopt(zmq.LINGER, 0)
        self._socket.setsockopt(zmq.SNDHWM, 1)
        address = f"ipc://{self._folder}/view"
        text = msgspec.json.encode(options).decode()
        try:
            self._socket.bind(address)
            # Ctrl-C is for the server, which ends the view.
            self._process: subprocess.Popen[bytes] | None = subprocess.Popen(
                [*_COMMAND, address, str(os.getpid()), text],
                start_new_session=True,
                env={**ONE_THREAD, **os.environ},
            )
        except BaseException:
            self._context.destroy(linger=0)
            shutil.rmtree(self._folder, ignore_errors=True)
            raise

    def offer(self, images: Images, planes: Sequence[memoryview], statistics: Statistics) -> None:
        """Images that were sent to a client; they replace those that nobody asked for."""
        if self._process is not None:
            self._newest = Shown(images=images, statistics=statistics), planes
            self._send_if_asked()

    def update(self) -> None:
        """Hand over what was asked for meanwhile.

        Raises BridgeError where the view could not start; the loop goes on without one that ends
        later.
        """
        if self._process is None:
            return
        while receive(self._socket):
            self._is_asked = True
            if not self._was_ready:
                self._was_ready = True
                shutil.rmtree(self._folder, ignore_errors=True)
        if self._process.poll() is not None:
            self._ended()
            return
        self._send_if_asked()

    def _send_if_asked(self) -> None:
        if not self._is_asked or self._newest is None:
            return
        shown, planes = self._newest
        self._newest, self._is_asked = None, False
        # One that has just ended takes nothing, which is noticed soon.
        with suppress(zmq.Again):
            send(self._socket, [_ENCODER.encode(shown), *planes])

    def _ended(self) -> None:
        assert self._process is not None
        code, self._process, self._newest = self._process.wait(), None, None
        if not self._was_ready:
            raise BridgeError(f"the browser view cannot start (it ended with code {code})")
        print_line("simgl: the browser view has ended; the server goes on")

    def close(self) -> None:
        """End the view's process."""
        if self._process is not None:
            self._process.terminate()
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(_PATIENCE)
            self._process.kill()
            self._process.wait()
        self._context.destroy(linger=0)
        shutil.rmtree(self._folder, ignore_errors=True)
