"""What the page's server answers: files, a model's shape, pixel values, images and control."""

from __future__ import annotations

import asyncio
import json
from functools import cache
from importlib.resources import files
from typing import Any

from tornado.iostream import StreamClosedError
from tornado.web import Application, RequestHandler
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from simgl.figures.displays import CameraImages, Display, pixel_values
from simgl.web.scene_description import model_bytes, scenario_description
from simgl.web.snapshots import Snapshot
from simgl.web.viewers import Viewers

_TYPES = {
    "index.html": "text/html; charset=utf-8",
    "style.css": "text/css; charset=utf-8",
    "view.js": "text/javascript; charset=utf-8",
    "scene3d.js": "text/javascript; charset=utf-8",
}
_HEADERS = {
    # Nothing is loaded from elsewhere, and no other site may embed or read what is shown.
    "Content-Security-Policy": "default-src 'self'; img-src 'self' blob: data:; "
    "style-src 'self' 'unsafe-inline'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'",
    "Cross-Origin-Resource-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
    "Server": "simgl",
}
_BOUNDARY = "simgl-frame"
# A viewer that says nothing for twice as long is gone [s].
_PING = 15
_MAX_MESSAGE = 4096


@cache
def _page_file(name: str) -> bytes:
    return (files("simgl.web") / "page" / name).read_bytes()


class _Guarded(RequestHandler):
    """Answers those who may see the page."""

    def initialize(self, viewers: Viewers) -> None:
        """viewers : of the page"""
        self._viewers = viewers

    def set_default_headers(self) -> None:
        """Of every answer."""
        for name, value in _HEADERS.items():
            self.set_header(name, value)

    def prepare(self) -> None:
        """Refuse those who may not."""
        access = self._viewers.access
        if not access.is_named(self.request.host):
            self._refuse(403, "this page is for browsers on this machine")
            return
        given = self.get_query_argument("token", None)
        if not access.admits(given) and not access.admits(self.get_cookie(self._cookie_name)):
            self._refuse(401, "a token is needed: open the address that simgl printed")
            return
        if access.token is not None and given is not None:
            self.set_cookie(
                self._cookie_name, access.token, httponly=True, samesite="Strict", path="/"
            )

    @property
    def _cookie_name(self) -> str:
        # Browsers share cookies between the ports of a host.
        return f"simgl_{self._viewers.port}"

    def _refuse(self, status: int, reason: str) -> None:
        self.set_status(status)
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(f"simgl: {reason}\n")

    def log_exception(self, *_: Any) -> None:
        """What a browser sends is no matter for the terminal."""


class _File(_Guarded):
    def get(self, name: str) -> None:
        name = name or "index.html"
        if name == "index.html" and self.get_query_argument("token", None) is not None:
            # The cookie opens it from here on; the token stays in no history.
            self.redirect("/")
            return
        self.set_header("Content-Type", _TYPES[name])
        self.finish(_page_file(name))


class _Scenario(_Guarded):
    def get(self) -> None:
        newest = self._viewers.newest
        self.finish({**scenario_description(newest.scenario), "follows": newest.follows})


class _Model(_Guarded):
    def get(self, name: str) -> None:
        scenario = self._viewers.newest.scenario
        if name not in scenario.models:
            self._refuse(404, "no spacecraft of this name")
            return
        self.set_header("Content-Type", "application/octet-stream")
        self.finish(model_bytes(scenario.models[name]))


class _Pixel(_Guarded):
    def get(self) -> None:
        _, snapshot = self._viewers.newest.newest()
        images = snapshot and snapshot.images.get(self.get_query_argument("camera", ""))
        try:
            column, row = (int(self.get_query_argument(key, "")) for key in ("x", "y"))
        except ValueError:
            self._refuse(400, "x and y must be whole numbers")
            return
        values = pixel_values(images, column, row) if images else None
        if values is None:
            self._refuse(404, "no such pixel")
            return
        self.finish(values)


class _Mjpeg(_Guarded):
    """An endless multipart stream of JPEG images, which browsers and image libraries show."""

    _gone = False

    async def get(self, camera: str) -> None:
        viewers = self._viewers
        cameras = viewers.newest.scenario.cameras
        if camera not in cameras:
            self._refuse(404, f"no camera of this name; there are {', '.join(cameras) or 'none'}")
            return
        shown = self.get_query_argument("show", "dn")
        if (wake := viewers.enter(self)) is None:
            self._refuse(503, "too many viewers")
            return
        viewers.newest.watch(self, camera, shown)
        self.set_header("Content-Type", f"multipart/x-mixed-replace; boundary={_BOUNDARY}")
        last = 0
        try:
            while not self._gone:
                number, snapshot = viewers.newest.newest()
                if snapshot is not None and number != last:
                    encoded = await viewers.encoded(number, snapshot, camera, shown)
                    if encoded is not None:
                        await self._write_part(encoded[1])
                        viewers.dropped += number - last - 1 if last else 0
                        last = number
                await wake.wait()
                wake.clear()
        except (StreamClosedError, TimeoutError):
            self._close()
        finally:
            viewers.leave(self)

    async def _write_part(self, jpeg: bytes) -> None:
        head = f"--{_BOUNDARY}\r\nContent-Type: image/jpeg\r\nContent-Length: {len(jpeg)}\r\n\r\n"
        self.write(head.encode() + jpeg + b"\r\n")
        # A coroutine of ours: waiting may then be given up without Tornado's complaint.
        await self._viewers.within_patience(self._flushed())
        self._viewers.sent += 1

    async def _flushed(self) -> None:
        await self.flush()

    def on_connection_close(self) -> None:
        """A viewer that waits for an image is gone at once."""
        self._gone = True
        self._viewers.wake(self)
        super().on_connection_close()

    def _close(self) -> None:
        connection = self.request.connection
        stream = getattr(connection, "stream", None)
        if stream is not None:
            stream.close()


class _View(_Guarded, WebSocketHandler):
    """A page: it says what it looks at and when it is ready, and gets the newest snapshot."""

    def initialize(self, viewers: Viewers) -> None:
        """viewers : of the page"""
        super().initialize(viewers)
        self._ready = True
        # Of camera and plane; None until the page has said.
        self._watched: tuple[str, str] | None = None
        self._task: asyncio.Task[None] | None = None

    def open(self, *_: str, **__: str) -> None:
        """A page opens its connection."""
        wake = self._viewers.enter(self)
        if wake is None:
            self.close(1013, "too many viewers")
            return
        self._wake = wake
        self._task = asyncio.ensure_future(self._send_all())

    def on_message(self, message: str | bytes) -> None:
        """A page is ready for the next image, looks at another one, or changes something."""
        try:
            said = json.loads(message)
            kind = said["type"]
        except (ValueError, TypeError, KeyError, RecursionError):
            self.close(1003, "not a message")
            return
        if kind == "ready":
            self._ready = True
        elif kind == "watch":
            self._watched = str(said.get("camera", ""))[:200], str(said.get("show", "dn"))[:200]
            self._viewers.newest.watch(self, *self._watched)
        elif self._viewers.newest.follows is None:
            key = f"exposure {said.get('camera')}" if kind == "exposure" else str(kind)
            self._viewers.newest.command(key[:200], said)
        self._viewers.wake(self)

    async def _send_all(self) -> None:
        viewers = self._viewers
        last: tuple[int, tuple[str, str]] = 0, ("", "")
        try:
            while True:
                number, snapshot = viewers.newest.newest()
                watched = self._watched
                nothing_new = snapshot is None or watched is None or last == (number, watched)
                if self._ready and not nothing_new:
                    assert snapshot is not None
                    assert watched is not None
                    self._ready = False
                    await viewers.within_patience(self._send(number, snapshot, *watched))
                    viewers.dropped += max(0, number - last[0] - 1) if last[0] else 0
                    last = number, watched
                await self._wake.wait()
                self._wake.clear()
        except (StreamClosedError, WebSocketClosedError):
            return
        except TimeoutError:
            # It reads nothing, so that it would not read a farewell either.
            if self.ws_connection is not None:
                self.ws_connection.client_terminated = True
            self.close()
            stream = getattr(self.ws_connection, "stream", None)
            if stream is not None:
                stream.close()

    async def _send(self, number: int, snapshot: Snapshot, camera: str, shown: str) -> None:
        viewers = self._viewers
        encoded = await viewers.encoded(number, snapshot, camera, shown)
        images = snapshot.images.get(camera)
        update = {
            "number": number,
            "camera": camera,
            "show": shown,
            "image": None if images is None else _described(images, encoded and encoded[0]),
            "has_pixels": encoded is not None,
            "viewers": len(viewers),
            "sent": viewers.sent,
            "dropped": viewers.dropped,
            **snapshot.status,
        }
        text = json.dumps(update)[:-1] + ', "scene": ' + snapshot.scene_json + "}"
        await self.write_message(text)
        if encoded is not None:
            await self.write_message(encoded[1], binary=True)
        viewers.sent += 1

    def on_close(self) -> None:
        """The page was left."""
        if self._task is not None:
            self._task.cancel()
        self._viewers.leave(self)


def _described(images: CameraImages, shown: Display | None) -> dict[str, Any]:
    """What the page says of an image."""
    camera = images.camera
    scale = None if shown is None else shown.scale
    return {
        "width_px": camera.detector.width,
        "height_px": camera.detector.height,
        "exposure_time_s": camera.exposure_time,
        "gain_dn_per_e": camera.detector.gain_dn_per_e,
        "saturated_share": images.saturated_share,
        "frame_ms": 1e3 * images.seconds,
        "planes": list(images.planes),
        "scale": None if scale is None else scale.as_json(),
    }


def application(viewers: Viewers) -> Application:
    """The answers of a viewers."""
    use = {"viewers": viewers}
    names = "|".join(_TYPES)
    return Application(
        [
            (rf"/({names}|)", _File, use),
            (r"/scenario\.json", _Scenario, use),
            (r"/model/([^/]+)", _Model, use),
            (r"/pixel\.json", _Pixel, use),
            (r"/stream/([^/]+)\.mjpg", _Mjpeg, use),
            (r"/view", _View, use),
        ],
        websocket_ping_interval=_PING,
        websocket_max_message_size=_MAX_MESSAGE,
        log_function=lambda _: None,
    )
