"""Replies with images: made of what the renderer drew, counted, and shown to those who look on."""

from __future__ import annotations

import time
from collections.abc import Callable

from simgl_bridge.hashes import shown_state_hash
from simgl_bridge.messages import Images, Statistics
from simgl_bridge.preview import Monitor
from simgl_bridge.render_queue import RenderQueue
from simgl_bridge.renderer_link import Payload
from simgl_bridge.renderer_messages import Draw, Drawn
from simgl_bridge.validate_request import ImageRequest
from simgl_bridge.web_feed import WebFeed


class ImageReplies:
    """Turns requests into tasks of the renderer and what it drew into replies.

    boot : of this server process
    monitor : publishes previews; None publishes none
    web : the browser view; None shows none
    statistics : the server's counters, for the browser view

    count : replies made so far
    """

    def __init__(
        self,
        queue: RenderQueue,
        *,
        boot: str,
        monitor: Monitor | None,
        web: WebFeed | None,
        statistics: Callable[[], Statistics],
    ) -> None:
        self._queue, self._boot = queue, boot
        self._monitor, self._web, self._statistics = monitor, web, statistics
        self.count = 0

    def task(self, request: ImageRequest) -> Draw:
        """What the renderer is to do for a request."""
        preview = self._monitor is not None and self._monitor.is_due(time.monotonic())
        return Draw(request=request, preview=preview)

    def reply(self, request: ImageRequest, drawn: Drawn) -> Images:
        """The reply to a request; its planes follow as frames (``planes_of``)."""
        self.count += 1
        scene = self._queue.scene
        assert scene is not None
        return Images(
            id=request.id,
            sequence=self.count,
            boot=self._boot,
            scene_hash=scene.scene_hash,
            tai_ns=request.tai_ns,
            state_hash=shown_state_hash(request, drawn.images, scene.seed),
            seed=scene.seed,
            bodies=drawn.bodies,
            images=drawn.images,
        )

    def publish(self, images: Images, drawn: Drawn, payload: Payload) -> None:
        """Show a reply that was sent in previews and in the browser view."""
        if self._monitor is not None:
            self._monitor.publish(images, drawn, payload[-1])
        if self._web is not None:
            self._web.offer(images, planes_of(drawn, payload), self._statistics())


def planes_of(drawn: Drawn, payload: Payload) -> list[memoryview]:
    """The planes as bytes, without a copy."""
    count = sum(len(image.planes) for image in drawn.images)
    return payload[:count]
