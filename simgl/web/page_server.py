"""The page's server: HTTP, WebSocket and MJPEG on a thread of its own.

A viewer gets the newest snapshot once it has shown the last one, so that nothing is queued for it
but one image; what it misses is dropped. An image is encoded once for all its viewers.
"""

from __future__ import annotations

import asyncio
import socket
import threading
from concurrent.futures import Future
from contextlib import suppress

from tornado.httpserver import HTTPServer

from simgl.errors import ConfigError
from simgl.web.page_handlers import application
from simgl.web.snapshots import NewestSnapshot
from simgl.web.viewers import Viewers
from simgl.web.web_access import WebAccess

# Seconds until a viewer that reads nothing is disconnected.
PATIENCE = 30.0
# Longest wait for connections that are being closed [s].
_FAREWELL = 2.0
# Requests are small; a body is never needed.
_MAX_BODY = 65536


class PageServer:
    """Serves the newest snapshots at an address until it is closed.

    patience : a viewer that reads nothing of an image for this long is disconnected [s]
    url : where browsers find it, with the token if there is one

    Raises ConfigError where the address cannot be bound.
    """

    def __init__(
        self, newest: NewestSnapshot, access: WebAccess, *, patience: float = PATIENCE
    ) -> None:
        self._newest, self._access = newest, access
        self._viewers = Viewers(newest, access, patience)
        self._started: Future[int] = Future()
        self._loop = asyncio.new_event_loop()
        self._end = asyncio.Event()
        self._thread = threading.Thread(target=self._serve, name="simgl-page", daemon=True)
        self._thread.start()
        try:
            self.port = self._started.result()
        except OSError as error:
            self.close()
            host = f"{access.host}:{access.port}"
            problem = f"{host} cannot be bound ({error.strerror or error})"
            raise ConfigError("command line", "--web-address", problem) from None
        host = f"[{access.host}]" if ":" in access.host else access.host
        query = "" if access.token is None else f"?token={access.token}"
        self.url = f"http://{host}:{self.port}/{query}"

    def _serve(self) -> None:
        try:
            self._loop.run_until_complete(self._run())
        finally:
            self._loop.close()

    async def _run(self) -> None:
        try:
            listening = socket.create_server(
                (self._access.host, self._access.port),
                family=socket.AF_INET6 if ":" in self._access.host else socket.AF_INET,
            )
        except OSError as error:
            self._started.set_exception(error)
            return
        viewers = self._viewers
        listening.setblocking(False)
        viewers.port = listening.getsockname()[1]
        server = HTTPServer(
            application(viewers), max_body_size=_MAX_BODY, max_header_size=_MAX_BODY
        )
        server.add_socket(listening)
        self._newest.on_news(self._on_news)
        self._started.set_result(viewers.port)
        await self._end.wait()
        self._newest.on_news(lambda: None)
        server.stop()
        with suppress(TimeoutError):
            await asyncio.wait_for(server.close_all_connections(), _FAREWELL)
        tasks = [t for t in asyncio.all_tasks() if t is not asyncio.current_task()]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def _on_news(self) -> None:
        """Called on any thread."""
        try:
            self._loop.call_soon_threadsafe(self._viewers.wake_all)
        except RuntimeError:
            # The loop has been closed meanwhile.
            return

    def close(self) -> None:
        """Disconnect all viewers and end the thread."""
        if self._thread.is_alive():
            # It may end by itself just now.
            with suppress(RuntimeError):
                self._loop.call_soon_threadsafe(self._end.set)
            self._thread.join()
        self._viewers.close()

    def __enter__(self) -> PageServer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
