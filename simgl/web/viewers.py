"""The viewers of a page: who they are, what wakes them, and the images that they share.

Everything here runs on the thread of the page's server, unless it says otherwise.
"""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from simgl.figures.displays import Display, display
from simgl.web.snapshots import NewestSnapshot, Snapshot
from simgl.web.web_access import WebAccess

# Pages and streams at once; further ones are refused.
MAX_VIEWERS = 64
# Wider images are subsampled.
_WIDEST = 1600

Encoded = tuple[Display, bytes]


class Viewers:
    """Pages and streams that are open.

    patience : a viewer that reads nothing of an image for this long is disconnected [s]
    port : that the server is bound to
    sent : images, to all viewers
    dropped : images that were newest between two that a viewer got
    """

    def __init__(self, newest: NewestSnapshot, access: WebAccess, patience: float) -> None:
        self.newest, self.access, self.patience = newest, access, patience
        self.port = access.port
        self.sent = 0
        self.dropped = 0
        self._wakes: dict[object, asyncio.Event] = {}
        self._encoded: dict[tuple[int, str, str], asyncio.Future[Encoded | None]] = {}
        self._encoder = ThreadPoolExecutor(1, thread_name_prefix="simgl-encode")

    def __len__(self) -> int:
        return len(self._wakes)

    def enter(self, viewer: object) -> asyncio.Event | None:
        """Register a viewer; its event is set when there is news. None where there are too many."""
        if len(self._wakes) >= MAX_VIEWERS:
            return None
        self._wakes[viewer] = asyncio.Event()
        return self._wakes[viewer]

    def leave(self, viewer: object) -> None:
        """A viewer left."""
        self._wakes.pop(viewer, None)
        self.newest.forget(viewer)

    def wake(self, viewer: object) -> None:
        """Something of a viewer has changed."""
        if (event := self._wakes.get(viewer)) is not None:
            event.set()

    def wake_all(self) -> None:
        """There is something new to show."""
        for event in self._wakes.values():
            event.set()

    async def within_patience(self, writing: Coroutine[Any, Any, None]) -> None:
        """Wait until something is written; raises TimeoutError for a viewer that reads nothing."""
        await asyncio.wait_for(writing, self.patience)

    async def encoded(
        self, number: int, snapshot: Snapshot, camera: str, shown: str
    ) -> Encoded | None:
        """The JPEG of a plane and its display; None where the snapshot lacks it."""
        key = number, camera, shown
        if key not in self._encoded:
            for old in [k for k in self._encoded if k[0] != number]:
                del self._encoded[old]
            images = snapshot.images.get(camera)
            if images is None or shown not in images.planes:
                return None

            def encode() -> Encoded | None:
                made = display(images, shown, _WIDEST)
                return None if made is None else (made, made.jpeg())

            loop = asyncio.get_running_loop()
            self._encoded[key] = loop.run_in_executor(self._encoder, encode)
        # One viewer that leaves must not cancel it for the others.
        return await asyncio.shield(self._encoded[key])

    def close(self) -> None:
        """End the encoder's thread."""
        self._encoder.shutdown()
