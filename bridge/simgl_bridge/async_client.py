"""The client for asyncio: several requests may be under way, up to the server's window."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from typing import TypeVar

import zmq.asyncio
from zmq.utils.monitor import parse_monitor_message

from simgl.errors import BridgeError
from simgl_bridge.access import ClientKeys
from simgl_bridge.body_pose import BodyPose
from simgl_bridge.client_errors import RemoteError
from simgl_bridge.client_images import Image, Tick
from simgl_bridge.client_protocol import ClientProtocol, check_timeout, server_deadline_ms, shot_of
from simgl_bridge.connect import dial
from simgl_bridge.framing import pack
from simgl_bridge.messages import (
    Bye,
    Error,
    ErrorCode,
    Images,
    Message,
    Ping,
    Pong,
    Render,
    Shot,
    Welcome,
)

# Before a request that was BUSY is sent again [s].
_PAUSE = 0.02

_R = TypeVar("_R", bound=Message)
_Reply = tuple[Message, Sequence[memoryview]]


class AsyncClient:
    """An asynchronous link to one server; errors as those of ``Client``.

    Requests beyond the server's window wait here until an earlier one is answered.

    >>> async with AsyncClient("tcp://127.0.0.1:5563") as client:
    ...     now = client.welcome.epoch_tai_ns
    ...     images = await asyncio.gather(*(client.render(now, name) for name in ("nav", "side")))
    """

    def __init__(
        self,
        address: str,
        *,
        timeout_s: float = 10.0,
        name: str = "client",
        keys: ClientKeys | None = None,
    ) -> None:
        check_timeout(timeout_s)
        self.address = address
        self.timeout_s = timeout_s
        self._name = name
        self._keys = keys
        self._protocol = ClientProtocol(address)
        self._open: dict[int | None, tuple[Message, asyncio.Future[_Reply]]] = {}
        self._readers: list[asyncio.Task[None]] = []

    @property
    def welcome(self) -> Welcome:
        """What the server said of itself: cameras, bodies, seed, window."""
        return self._protocol.welcome

    async def __aenter__(self) -> AsyncClient:
        self._context = zmq.asyncio.Context()
        try:
            self._socket, self._monitor = dial(self._context, self.address, self._name, self._keys)
            self._readers = [
                asyncio.create_task(self._read()),
                asyncio.create_task(self._read_events()),
            ]
            welcome, _ = await self._ask(self._protocol.hello(self._name), Welcome, None)
            self._protocol.greeted(welcome)
        except BaseException:
            await self._hang_up(linger=0)
            raise
        self._credit = asyncio.Semaphore(welcome.window)
        return self

    async def __aexit__(self, *_: object) -> None:
        if self._protocol.connected:
            await self._socket.send_multipart(pack(Bye()))
        await self._hang_up(linger=100)

    async def _hang_up(self, linger: int) -> None:
        for reader in self._readers:
            reader.cancel()
        await asyncio.gather(*self._readers, return_exceptions=True)
        self._readers = []
        self._context.destroy(linger=linger)

    async def ping(self) -> float:
        """Round-trip time [s]."""
        id, loop = self._protocol.next_id(), asyncio.get_running_loop()
        start = loop.time()
        await self._ask(Ping(id=id), Pong, id)
        return loop.time() - start

    async def render(
        self,
        tai_ns: int,
        camera: str,
        bodies: Mapping[str, BodyPose] | None = None,
        exposure_time_s: float | None = None,
        products: Sequence[str] = ("dn",),
        *,
        gain_dn_per_e: float | None = None,
        sun_position_m: Sequence[float] | None = None,
        lamps: Mapping[str, float] | None = None,
        moving: bool = False,
        seek: bool = False,
    ) -> Image:
        """The picture that one camera takes of a state; see ``Client.render``."""
        tick = await self.render_all(
            tai_ns,
            [shot_of(camera, exposure_time_s, gain_dn_per_e, products)],
            bodies,
            sun_position_m=sun_position_m,
            lamps=lamps,
            moving=moving,
            seek=seek,
        )
        return tick[camera]

    async def render_all(
        self,
        tai_ns: int,
        cameras: Sequence[Shot],
        bodies: Mapping[str, BodyPose] | None = None,
        *,
        sun_position_m: Sequence[float] | None = None,
        lamps: Mapping[str, float] | None = None,
        moving: bool = False,
        seek: bool = False,
    ) -> Tick:
        """The pictures that several cameras take of one state; see ``Client.render_all``."""
        deadline_ms = server_deadline_ms(self.timeout_s)
        request = self._protocol.render(
            tai_ns, cameras, bodies, sun_position_m, seek, deadline_ms, lamps, moving
        )
        self._check_open()
        async with self._credit:
            images, payload = await self._ask_again_while_busy(request)
        return self._protocol.shown(request, images, payload)

    async def _ask_again_while_busy(self, request: Render) -> tuple[Images, Sequence[memoryview]]:
        # What was given up here, by a timeout or a cancelled task, may still wait at the server.
        loop = asyncio.get_running_loop()
        end = loop.time() + self.timeout_s
        while True:
            try:
                return await self._ask(request, Images, request.id, end - loop.time())
            except RemoteError as error:
                if error.code != ErrorCode.BUSY or loop.time() + _PAUSE >= end:
                    raise
            await asyncio.sleep(_PAUSE)

    def _check_open(self) -> None:
        if not self._readers:
            raise BridgeError(f"{self.address}: this client is not open; it opens with async with")

    async def _ask(
        self, message: Message, kind: type[_R], id: int | None, seconds: float | None = None
    ) -> tuple[_R, Sequence[memoryview]]:
        self._check_open()
        answer: asyncio.Future[_Reply] = asyncio.get_running_loop().create_future()
        self._open[id] = (message, answer)
        try:
            async with asyncio.timeout(self.timeout_s if seconds is None else seconds):
                await self._socket.send_multipart(pack(message))
                reply, payload = await answer
        except TimeoutError:
            raise self._protocol.timed_out(message, self.timeout_s) from None
        finally:
            self._open.pop(id, None)
        if isinstance(reply, Error):
            raise RemoteError(self.address, reply)
        if not isinstance(reply, kind):
            raise BridgeError(f"{self.address}: answered {type(reply).__name__.lower()}")
        return reply, payload

    async def _read(self) -> None:
        """Hand each reply to the request that it answers; those to given-up ones are dropped."""
        while True:
            parts = [f.buffer for f in await self._socket.recv_multipart(copy=False)]
            try:
                reply = self._protocol.opened(parts)
            except BridgeError as error:
                self._fail(error)
                continue
            if isinstance(reply, Bye):
                self._fail("the server said goodbye")
                continue
            id = getattr(reply, "id", None)
            if isinstance(reply, Error) and id is None:
                # Of which request the server cannot say: none of them waits in vain.
                self._fail(RemoteError(self.address, reply))
                continue
            _, answer = self._open.get(id, (None, None))
            if answer is not None and not answer.done():
                answer.set_result((reply, parts[2:]))

    async def _read_events(self) -> None:
        while True:
            event = parse_monitor_message(await self._monitor.recv_multipart())["event"]
            try:
                broke = self._protocol.heed(int(event))
            except BridgeError as error:
                self._fail(error)
                continue
            if broke:
                # What came before the break counts: let the other reader have it first.
                await asyncio.sleep(0.01)
                self._fail("the connection broke")

    def _fail(self, why: str | BridgeError) -> None:
        for message, answer in self._open.values():
            if not answer.done():
                error = self._protocol.no_answer(why, message) if isinstance(why, str) else why
                answer.set_exception(error)
