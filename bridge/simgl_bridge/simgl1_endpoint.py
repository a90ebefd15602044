"""The endpoint of simgl/1: one ROUTER socket whose requests become images of the renderer."""

from __future__ import annotations

import math
import time
import uuid
from functools import partial
from pathlib import Path
from typing import Any

import msgspec
import zmq

from simgl_bridge.access import ANY_LOCAL, Access
from simgl_bridge.client_sessions import ClientSession, ClientSessions, Frames, ReplyCache
from simgl_bridge.framing import VERSION, BadMessageError, error_of, pack, unpack_request
from simgl_bridge.free_run import FreeRun
from simgl_bridge.image_replies import ImageReplies, planes_of
from simgl_bridge.messages import (
    Bye,
    Configure,
    Error,
    ErrorCode,
    Hello,
    Message,
    Next,
    Ping,
    Pong,
    Render,
    State,
    Statistics,
    Stats,
    Welcome,
)
from simgl_bridge.preview import Monitor
from simgl_bridge.render_queue import RenderQueue
from simgl_bridge.renderer_link import Payload
from simgl_bridge.renderer_messages import Answer, Drawn, ServedScene, Task
from simgl_bridge.router_socket import RouterSocket
from simgl_bridge.scenario_folder import scenario_names
from simgl_bridge.server import Work
from simgl_bridge.validate_request import (
    FieldErrors,
    check_ranges,
    check_request,
)
from simgl_bridge.web_feed import WebFeed
from simgl_bridge.welcome import welcome

# Time for replies under way when the server stops [ms].
LINGER_MS = 2000
# Of the Pong that answers a Hello which has to wait; clients count their requests from 1.
_HELLO_ID = 0


class Simgl1Endpoint:
    """Answers simgl/1 at an address.

    queue : of requests, shared with other endpoints
    root : folder of the scenarios that a client may choose from; None offers none
    monitor : address of the PUB socket with previews; None publishes none
    rate_hz : highest rate of images in free-run; None sets no limit
    web : the browser view, which sees what clients are sent; closed with the endpoint's server

    Raises ConfigError for an address open to strangers and BridgeError where it cannot be bound.
    """

    def __init__(
        self,
        queue: RenderQueue,
        address: str,
        *,
        root: Path | None = None,
        access: Access = ANY_LOCAL,
        monitor: str | None = None,
        rate_hz: float | None = None,
        web: WebFeed | None = None,
    ) -> None:
        self._web = web
        self._queue = queue
        self._root = root
        self._boot = uuid.uuid4().hex
        self._started = time.monotonic()
        self._repeated = 0
        self._reply_cache = ReplyCache()
        self._sessions = ClientSessions()
        self._greeting: dict[bytes, None] = {}
        self._configured_by: bytes | None = None
        self._context: zmq.Context[Any] = zmq.Context()
        self._authenticator = access.start_authenticator(self._context)
        try:
            self._router = RouterSocket(self._context, address, access, on_gone=self._forget_client)
            self.socket, self.address = self._router.socket, self._router.address
            self._monitor = None
            if monitor is not None:
                self._monitor = Monitor(self._context, monitor, access)
            self._replies = ImageReplies(
                queue,
                boot=self._boot,
                monitor=self._monitor,
                web=web,
                statistics=lambda: self._statistics(0),
            )
            interval = 0.0 if rate_hz is None else 1.0 / rate_hz
            self._free_run = FreeRun(queue, self._router, self._replies, interval)
        except BaseException:
            self._destroy(0)
            raise

    @property
    def summary(self) -> str:
        """One line: scenario, address, renderer, cameras and bodies."""
        scene = self._queue.scene
        assert scene is not None
        sizes = [f"{name} {c.width}x{c.height}" for name, c in scene.cameras.items()]
        monitor = "" if self._monitor is None else f", previews at {self._monitor.address}"
        return (
            f'simgl serves "{scene.name}" at {self.address} ({VERSION}){monitor} '
            f"on {scene.renderer}; "
            f"cameras: {', '.join(sizes) or 'none'}; bodies: {', '.join(scene.models) or 'none'}"
        )

    # Receiving

    def receive(self) -> None:
        """Receive what has arrived; requests that need no image are answered at once."""
        for client, frames in self._router.arrived():
            session = self._sessions.heard(client)
            self._router.answer_or_refuse(client, partial(self._request, client, session, frames))

    def _forget_client(self, client: bytes) -> None:
        self._queue.drop(client)
        self._reply_cache.forget(client)
        self._free_run.forget(client)
        self._sessions.forget(client)
        self._greeting.pop(client, None)
        if self._configured_by == client:
            self._configured_by = None

    def _request(self, client: bytes, session: ClientSession, frames: list[bytes]) -> None:
        request = unpack_request(frames)
        check_ranges(request)
        if isinstance(request, Render):
            self._enqueue(client, session, request, frames[1])
        elif isinstance(request, State):
            self._free_run.accept_state(client, session.name, request)
        elif isinstance(request, Next):
            self._free_run.wait_for_images(client, request)
        elif isinstance(request, Configure):
            self._queue_configure(client, request)
        elif isinstance(request, Bye):
            self._forget_client(client)
        else:
            self._router.send(client, pack(self._quick_reply(client, session, request)))

    def _quick_reply(self, client: bytes, session: ClientSession, request: Message) -> Message:
        if isinstance(request, Ping):
            return self._pong(request.id)
        if isinstance(request, Stats):
            return self._statistics(request.id)
        assert isinstance(request, Hello)
        if VERSION not in request.versions:
            problem = f'must hold "{VERSION}", got {list(request.versions)}'
            raise BadMessageError(ErrorCode.VERSION, "versions", problem)
        self._queue.drop(client)
        self._reply_cache.forget(client)
        session.name, session.last_tai_ns = request.client[:60], None
        if self._queue.scene is not None:
            return self._welcome(None, self._queue.scene)
        # The welcome follows. Clients that do not know a status drop an id that they did not use.
        self._greeting[client] = None
        return self._pong(_HELLO_ID)

    def _pong(self, id: int) -> Pong:
        return Pong(id=id, boot=self._boot, status=self._queue.status)

    # Lock-step

    def _enqueue(
        self, client: bytes, session: ClientSession, request: Render, header: bytes
    ) -> None:
        if self._answer_again(client, request, header):
            return
        # The reply to a request that waits or is being drawn answers its repetition too.
        key = (request.id, header)
        if self._queue.has(client, key):
            return
        deadline = math.inf
        if request.deadline_ms is not None:
            deadline = time.monotonic() + request.deadline_ms * 1e-3
        work = Work(
            key=key,
            begin=lambda: self._router.answer_or_refuse(
                client, lambda: self._begin_render(client, session, request, header), request.id
            ),
            finish=lambda answer, payload, late: self._router.answer_or_refuse(
                client,
                lambda: self._finish_render(
                    client, session, request, header, answer, payload, late
                ),
                request.id,
            ),
            deadline=deadline,
            overdue=lambda: self._router.refuse(client, _too_late(request)),
        )
        self._offer(client, request.id, work)

    def _answer_again(self, client: bytes, request: Render, header: bytes) -> bool:
        """Send the reply that a request got before, if it did."""
        frames = self._reply_cache.find(client, request.id, header)
        if frames is None:
            return False
        self._repeated += 1
        self._router.send(client, frames)
        return True

    def _offer(self, client: bytes, id: int, work: Work) -> None:
        if not self._queue.offer(client, work):
            problem = f"{self._queue.window} requests of this client wait already, its window"
            raise BadMessageError(ErrorCode.BUSY, "", problem, id, retryable=True)

    def _begin_render(
        self, client: bytes, session: ClientSession, request: Render, header: bytes
    ) -> Task | None:
        # Drawn too late for an earlier try, or another request of this id was before it.
        if self._answer_again(client, request, header):
            return None
        last = session.last_tai_ns
        if last is not None and request.tai_ns < last and not request.seek:
            problem = f'must not be before {last}, the last request\'s, unless "seek" is true, '
            problem += f"got {request.tai_ns}"
            raise BadMessageError(ErrorCode.TIME_BACKWARDS, "tai_ns", problem, request.id)
        assert self._queue.scene is not None
        check_request(self._queue.scene, request)
        return self._replies.task(request)

    def _finish_render(
        self,
        client: bytes,
        session: ClientSession,
        request: Render,
        header: bytes,
        answer: Answer,
        payload: Payload,
        late: bool,
    ) -> None:
        if isinstance(answer, Error):
            if not late:
                self._refuse(client, answer, request.id)
            return
        assert isinstance(answer, Drawn)
        images = self._replies.reply(request, answer)
        frames: Frames = [*pack(images), *planes_of(answer, payload)]
        # For a repetition, also where this request was refused as too late.
        self._reply_cache.store(client, request.id, header, frames)
        if late:
            return
        session.last_tai_ns = request.tai_ns
        self._router.send(client, frames)
        self._replies.publish(images, answer, payload)

    def _refuse(self, client: bytes, error: Error, id: int) -> None:
        self._router.refuse(client, msgspec.structs.replace(error, id=id))

    def update(self, now: float) -> float:
        """Welcome those who wait, queue the newest state, and refuse what is overdue."""
        self._router.update(now)
        if self._web is not None:
            self._web.update()
        if self._greeting and self._queue.scene is not None:
            # A client that has left meanwhile is forgotten while the others are welcomed.
            waiting, self._greeting = self._greeting, {}
            for client in waiting:
                self._router.send(client, pack(self._welcome(None, self._queue.scene)))
        return self._free_run.update(now)

    # The scene

    def _queue_configure(self, client: bytes, request: Configure) -> None:
        self._check_scenario(request)
        owner = None if self._configured_by is None else self._sessions.present(self._configured_by)
        if owner is not None and owner.client != client:
            problem = f'"{owner.name}" chose the scenario; it has not left'
            code = ErrorCode.NOT_OWNER
            raise BadMessageError(code, "", problem, request.id, retryable=True)
        self._configured_by = client

        def begin() -> Task | None:
            return self._router.answer_or_refuse(
                client, lambda: self._begin_configure(request), request.id
            )

        def finish(answer: Answer, payload: Payload, late: bool) -> None:
            del payload, late
            if isinstance(answer, Error):
                self._refuse(client, answer, request.id)
            else:
                assert isinstance(answer, ServedScene)
                self._router.send(client, pack(self._welcome(request.id, answer)))

        self._offer(client, request.id, Work(begin=begin, finish=finish))

    def _begin_configure(self, request: Configure) -> Task:
        self._check_scenario(request)
        return request

    def _check_scenario(self, request: Configure) -> None:
        names = dict.fromkeys(scenario_names(self._root))
        if request.scenario is not None and request.scenario not in names:
            errors = FieldErrors(request.id)
            errors.unknown_name("scenario", request.scenario, names, ErrorCode.NO_SCENARIO)

    def _welcome(self, id: int | None, scene: ServedScene) -> Welcome:
        return welcome(
            scene,
            id=id,
            boot=self._boot,
            window=self._queue.window,
            scenarios=scenario_names(self._root),
            status=self._queue.status,
        )

    def _statistics(self, id: int) -> Statistics:
        return Statistics(
            id=id,
            boot=self._boot,
            uptime_s=time.monotonic() - self._started,
            images=self._replies.count,
            repeated=self._repeated,
            errors=self._router.errors,
            busy=self._router.busy,
            lost=self._router.lost,
            waiting=len(self._queue),
            clients=len(self._sessions.all_present()),
        )

    # The end

    def farewell(self) -> None:
        """Say Bye to every client heard of lately; queued requests get no other answer."""
        for client in self._sessions.all_present():
            self._router.send(client, pack(Bye(boot=self._boot)))

    def close(self) -> None:
        """Free the address once the last replies are sent, within two seconds."""
        self._router.close()
        self._destroy(LINGER_MS)

    def _destroy(self, linger: int) -> None:
        if self._authenticator is not None:
            self._authenticator.stop()
        self._context.destroy(linger=linger)

    def __enter__(self) -> Simgl1Endpoint:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _too_late(request: Render) -> Error:
    problem = f"is over: too late, there was no image after {request.deadline_ms} ms"
    code = ErrorCode.DEADLINE
    return error_of(BadMessageError(code, "deadline_ms", problem, request.id, retryable=True))
