"""The client for asyncio: several requests may be pending, up to the server's window."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import TypeVar, Unpack

import zmq.asyncio
from zmq.utils.monitor import parse_monitor_message

from simgl.errors import BridgeError
from simgl_bridge.access import ClientKeys
from simgl_bridge.body_pose import BodyPose
from simgl_bridge.client_call import (
    READY_TIMEOUT,
    Payload,
    check_timeouts,
    open_call,
    server_deadline_ms,
)
from simgl_bridge.client_images import Image, ImageSet
from simgl_bridge.client_protocol import ClientProtocol, RenderOptions, shot_of
from simgl_bridge.framing import VERSION, pack
from simgl_bridge.message_parts import ServerStatus, Shot
from simgl_bridge.messages import (
    Bye,
    Hello,
    Images,
    Message,
    Ping,
    Pong,
    Welcome,
)
from simgl_bridge.sockets import connect

_Reply = TypeVar("_Reply", bound=Message)


class AsyncClient:
    """An asynchronous connection to one server, with the errors and timeouts of ``Client``.

    address, timeout_s, ready_timeout_s, name, keys, on_status : as for ``Client``

    Requests beyond the server's window wait here until an earlier one is answered.

    >>> async with AsyncClient("tcp://127.0.0.1:5563") as client:
    ...     now = client.welcome.epoch_tai_ns
    ...     images = await asyncio.gather(*(client.render(now, name) for name in ("nav", "side")))
    """

    def __init__(
        self,
        address: str,
        *,
        timeout_s: float | None = None,
        ready_timeout_s: float = READY_TIMEOUT,
        name: str = "client",
        keys: ClientKeys | None = None,
        on_status: Callable[[ServerStatus], object] | None = None,
    ) -> None:
        check_timeouts(timeout_s, ready_timeout_s)
        self.address = address
        self.timeout_s = timeout_s
        self._ready_timeout_s = ready_timeout_s
        self._name = name
        self._keys = keys
        self._protocol = ClientProtocol(address, on_status)
        self._readers: list[asyncio.Task[None]] = []

    @property
    def welcome(self) -> Welcome:
        """The server's description of itself: cameras, bodies, seed, window."""
        return self._protocol.welcome

    async def __aenter__(self) -> AsyncClient:
        self._context = zmq.asyncio.Context()
        try:
            self._socket, self._monitor = connect(
                self._context, self.address, self._name, self._keys
            )
            readers = (self._read_replies(), self._read_events())
            self._readers = [asyncio.create_task(reader) for reader in readers]
            hello = Hello(client=self._name, versions=(VERSION,))
            welcome, _ = await self._call(hello, Welcome)
        except BaseException:
            await self._disconnect(linger=0)
            raise
        self._window = asyncio.Semaphore(welcome.window)
        return self

    async def __aexit__(self, *_: object) -> None:
        if self._protocol.connected:
            await self._socket.send_multipart(pack(Bye()))
        await self._disconnect(linger=100)

    async def _disconnect(self, linger: int) -> None:
        for reader in self._readers:
            reader.cancel()
        await asyncio.gather(*self._readers, return_exceptions=True)
        self._readers = []
        self._context.destroy(linger=linger)

    async def ping(self) -> float:
        """Round-trip time [s]."""
        start = time.perf_counter()
        await self._call(Ping(id=self._protocol.next_id()), Pong)
        return time.perf_counter() - start

    async def render(
        self,
        tai_ns: int,
        camera: str,
        bodies: Mapping[str, BodyPose] | None = None,
        exposure_time_s: float | None = None,
        products: Sequence[str] = ("dn",),
        *,
        gain_dn_per_e: float | None = None,
        **options: Unpack[RenderOptions],
    ) -> Image:
        """The image of one camera and one state.

        tai_ns, camera, bodies, exposure_time_s, products, gain_dn_per_e, options : as for
            ``Client.render``
        """
        shots = [shot_of(camera, exposure_time_s, gain_dn_per_e, products)]
        return (await self.render_all(tai_ns, shots, bodies, **options))[camera]

    async def render_all(
        self,
        tai_ns: int,
        cameras: Sequence[Shot],
        bodies: Mapping[str, BodyPose] | None = None,
        **options: Unpack[RenderOptions],
    ) -> ImageSet:
        """The images of several cameras and one state.

        tai_ns, cameras, bodies, options : as for ``Client.render_all``
        """
        deadline_ms = server_deadline_ms(self.timeout_s)
        request = self._protocol.render(tai_ns, cameras, bodies, deadline_ms, **options)
        self._check_open()
        async with self._window:
            # A request given up here, by a timeout or a cancelled task, may still wait at the
            # server and take its place in the window.
            reply, payload = await self._call(request, Images, retry_busy=True)
        return self._protocol.images(request, reply, payload)

    def _check_open(self) -> None:
        if not self._readers:
            raise BridgeError(f"{self.address}: this client is not open; it opens with async with")

    async def _call(
        self, request: Message, reply_type: type[_Reply], *, retry_busy: bool = False
    ) -> tuple[_Reply, Payload]:
        """The reply to a request, with its payload frames."""
        self._check_open()
        changed = asyncio.Event()
        call = open_call(
            request,
            reply_type,
            self.timeout_s,
            self._ready_timeout_s,
            retry_busy=retry_busy,
            on_change=changed.set,
        )
        self._protocol.open(call)
        try:
            while not call.done:
                changed.clear()
                frames = self._protocol.due(call)
                with suppress(TimeoutError):
                    async with asyncio.timeout(call.wake_at - time.monotonic()):
                        if frames:
                            await self._socket.send_multipart(frames)
                        await changed.wait()
        finally:
            self._protocol.close(call)
        return call.result()

    async def _read_replies(self) -> None:
        while True:
            frames = await self._socket.recv_multipart(copy=False)
            self._protocol.handle_frames([frame.buffer for frame in frames])

    async def _read_events(self) -> None:
        while True:
            event = parse_monitor_message(await self._monitor.recv_multipart())["event"]
            if self._protocol.handle_event(int(event)):
                # Replies that arrived before the break count: let the other reader have them first.
                await asyncio.sleep(0.01)
                self._protocol.handle_break()
