"""The endpoint of simgl/1: one ROUTER socket whose requests become images of a render session."""

from __future__ import annotations

import time
import uuid
from collections.abc import Callable, Hashable
from functools import partial
from typing import Any

import msgspec
import zmq

from simgl.errors import SimglError
from simgl_bridge.access import ANY_LOCAL, Access
from simgl_bridge.client_sessions import ClientSession, ClientSessions, Frames, ReplyCache
from simgl_bridge.describe_server import welcome
from simgl_bridge.framing import VERSION, BadMessageError, pack, unpack_request
from simgl_bridge.free_run import StateStream, StreamedImages
from simgl_bridge.hashes import shown_state_hash
from simgl_bridge.messages import (
    Bye,
    Configure,
    ErrorCode,
    Hello,
    Images,
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
from simgl_bridge.render_request import RenderedImages, render_images
from simgl_bridge.render_session import GpuLostError, RenderSession
from simgl_bridge.router_socket import RouterSocket
from simgl_bridge.server import FairQueue
from simgl_bridge.session_recording import SessionRecorder
from simgl_bridge.validate_request import (
    FieldErrors,
    ImageRequest,
    check_ranges,
    check_request,
)

# Requests of one client that may be queued: n + 1 is rendered while n travels.
WINDOW = 2
# Time for replies under way when the server stops [ms].
LINGER_MS = 2000
# Identity in the queue of the free-run stream; no client can have it.
_STREAM = b""


class Simgl1Endpoint:
    """Answers simgl/1 at an address.

    queue : of requests, shared with other endpoints
    monitor : address of the PUB socket with previews; None publishes none
    rate_hz : highest rate of images in free-run; None sets no limit
    recorder : of every reply with images; None records nothing

    Raises ConfigError for an address open to strangers and BridgeError where it cannot be bound.
    """

    def __init__(
        self,
        render_session: RenderSession,
        queue: FairQueue,
        address: str,
        *,
        access: Access = ANY_LOCAL,
        monitor: str | None = None,
        rate_hz: float | None = None,
        recorder: SessionRecorder | None = None,
    ) -> None:
        self._render_session = render_session
        self._queue = queue
        self._recorder = recorder
        self._boot = uuid.uuid4().hex
        self._started = time.monotonic()
        self._sequence = 0
        self._repeated = 0
        self._replies = ReplyCache()
        self._sessions = ClientSessions()
        self._stream = StateStream(0.0 if rate_hz is None else 1.0 / rate_hz)
        self._configured_by: bytes | None = None
        self._context: zmq.Context[Any] = zmq.Context()
        self._authenticator = access.start_authenticator(self._context)
        try:
            self._router = RouterSocket(
                self._context,
                address,
                access,
                max_pixels=self._max_pixels,
                on_gone=self._forget_client,
            )
            self.socket, self.address = self._router.socket, self._router.address
            self._monitor = None
            if monitor is not None:
                self._monitor = Monitor(self._context, monitor, access)
        except BaseException:
            self._destroy(0)
            raise

    @property
    def _max_pixels(self) -> int:
        detectors = [c.detector for c in self._render_session.scenario.cameras.values()]
        return max((d.width * d.height for d in detectors), default=1)

    @property
    def summary(self) -> str:
        """One line: scenario, address, renderer, cameras and bodies."""
        scenario = self._render_session.scenario
        sizes = [
            f"{name} {c.detector.width}x{c.detector.height}" for name, c in scenario.cameras.items()
        ]
        monitor = "" if self._monitor is None else f", previews at {self._monitor.address}"
        return (
            f'simgl serves "{scenario.name}" at {self.address} ({VERSION}){monitor} '
            f"on {self._render_session.renderer_name}; "
            f"cameras: {', '.join(sizes) or 'none'}; bodies: {', '.join(scenario.models) or 'none'}"
        )

    # Receiving

    def receive(self) -> None:
        """Receive what has arrived; requests that need no image are answered at once."""
        for client, frames in self._router.arrived():
            session = self._sessions.heard(client)
            self._router.answer_or_refuse(client, partial(self._request, client, session, frames))

    def _forget_client(self, client: bytes) -> None:
        self._queue.drop(client)
        self._replies.forget(client)
        self._stream.forget(client)
        self._sessions.forget(client)
        if self._configured_by == client:
            self._configured_by = None

    def _request(self, client: bytes, session: ClientSession, frames: list[bytes]) -> None:
        request = unpack_request(frames)
        check_ranges(request)
        if isinstance(request, Render):
            self._enqueue(client, session, request, frames[1])
        elif isinstance(request, State):
            self._accept_state(client, session, request)
        elif isinstance(request, Next):
            self._wait_for_images(client, request)
        elif isinstance(request, Configure):
            self._queue_configure(client, request)
        elif isinstance(request, Bye):
            self._forget_client(client)
        else:
            self._router.send(client, pack(self._quick_reply(client, session, request)))

    def _quick_reply(self, client: bytes, session: ClientSession, request: Message) -> Message:
        if isinstance(request, Ping):
            return Pong(id=request.id, boot=self._boot)
        if isinstance(request, Stats):
            return self._statistics(request.id)
        assert isinstance(request, Hello)
        if VERSION not in request.versions:
            problem = f'must hold "{VERSION}", got {list(request.versions)}'
            raise BadMessageError(ErrorCode.VERSION, "versions", problem)
        self._queue.drop(client)
        self._replies.forget(client)
        session.name, session.last_tai_ns = request.client[:60], None
        return self._welcome(None)

    # Lock-step

    def _enqueue(
        self, client: bytes, session: ClientSession, request: Render, header: bytes
    ) -> None:
        if frames := self._replies.find(client, request.id, header):
            self._repeated += 1
            self._router.send(client, frames)
            return
        # The reply to a queued request answers its repetition too.
        key = (request.id, header)
        if self._queue.has(client, key):
            return
        arrived = time.monotonic()

        def render() -> None:
            self._router.answer_or_refuse(
                client, lambda: self._render(client, session, request, header, arrived), request.id
            )

        self._offer(client, request.id, render, key)

    def _offer(
        self, client: bytes, id: int, work: Callable[[], None], key: Hashable = None
    ) -> None:
        if not self._queue.offer(client, key, work):
            problem = f"{self._queue.window} requests of this client wait already, its window"
            raise BadMessageError(ErrorCode.BUSY, "", problem, id, retryable=True)

    def _render(
        self, client: bytes, session: ClientSession, request: Render, header: bytes, arrived: float
    ) -> None:
        # Another request of this id may have been queued before it.
        self._replies.find(client, request.id, header)
        waited = (time.monotonic() - arrived) * 1000.0
        if request.deadline_ms is not None and waited > request.deadline_ms:
            problem = f"{request.deadline_ms} ms were over when the turn came, at {waited:.0f} ms"
            code = ErrorCode.DEADLINE
            raise BadMessageError(code, "deadline_ms", problem, request.id, retryable=True)
        last = session.last_tai_ns
        if last is not None and request.tai_ns < last and not request.seek:
            problem = f'must not be before {last}, the last request\'s, unless "seek" is true, '
            problem += f"got {request.tai_ns}"
            raise BadMessageError(ErrorCode.TIME_BACKWARDS, "tai_ns", problem, request.id)
        rendered = self._rendered(request)
        session.last_tai_ns = request.tai_ns
        images = self._images(request, rendered)
        frames: Frames = [*pack(images), *_payload(rendered)]
        self._replies.store(client, request.id, header, frames)
        self._router.send(client, frames)
        self._publish_preview(images, rendered)

    def _rendered(self, request: ImageRequest) -> RenderedImages:
        """The images of a request, on record."""
        rendered = render_images(self._render_session, request)
        if self._recorder is not None:
            seed = self._render_session.scenario.seed
            self._recorder.answered(
                request,
                shown_state_hash(request, rendered.images, seed),
                rendered.bodies,
                rendered.images,
                _payload(rendered),
            )
        return rendered

    def _images(self, request: ImageRequest, rendered: RenderedImages) -> Images:
        self._sequence += 1
        seed = self._render_session.scenario.seed
        return Images(
            id=request.id,
            sequence=self._sequence,
            boot=self._boot,
            scene_hash=self._render_session.scene_hash,
            tai_ns=request.tai_ns,
            state_hash=shown_state_hash(request, rendered.images, seed),
            seed=seed,
            bodies=rendered.bodies,
            images=rendered.images,
        )

    def _publish_preview(self, images: Images, rendered: RenderedImages) -> None:
        if self._monitor is not None:
            self._monitor.publish(images, rendered.digital)

    # Free-run

    def _accept_state(self, client: bytes, session: ClientSession, state: State) -> None:
        check_request(self._render_session.scenario, state)
        if not self._stream.accept(client, session.name, state, time.monotonic()):
            owner = self._stream.owner_name
            problem = f'"{owner}" streams states here; it has not left'
            code = ErrorCode.NOT_OWNER
            raise BadMessageError(code, "", problem, state.id, retryable=True)

    def _wait_for_images(self, client: bytes, request: Next) -> None:
        if not self._stream.wait(client, request, time.monotonic()):
            problem = "too many clients wait for the next picture"
            raise BadMessageError(ErrorCode.BUSY, "", problem, request.id, retryable=True)
        self._answer_waiting()

    def update(self, now: float) -> float:
        """Queue the newest state, and refuse requests whose deadline is over."""
        if self._stream.due(now) and not self._queue.has(_STREAM, 0):
            self._queue.offer(_STREAM, 0, self._render_stream)
        for client, request in self._stream.take_overdue(now):
            problem = f"no picture after sequence {request.after} came in time"
            code = ErrorCode.DEADLINE
            self._router.refuse(
                client, BadMessageError(code, "", problem, request.id, retryable=True)
            )
        return self._stream.next_event()

    def _render_stream(self) -> None:
        taken = self._stream.take(time.monotonic())
        if taken is None:
            return
        owner, state, dropped = taken

        def render() -> None:
            rendered = self._rendered(state)
            images = self._images(state, rendered)
            images = msgspec.structs.replace(images, state_id=state.id, dropped=dropped)
            self._stream.last = StreamedImages(images, _payload(rendered))
            self._answer_waiting()
            self._publish_preview(images, rendered)

        self._router.answer_or_refuse(owner, render, state.id)

    def _answer_waiting(self) -> None:
        last = self._stream.last
        for client, request in self._stream.take_answered():
            assert last is not None
            images = msgspec.structs.replace(last.images, id=request.id)
            self._router.send(client, [*pack(images), *last.pixels])

    # The scene

    def _queue_configure(self, client: bytes, request: Configure) -> None:
        errors = FieldErrors(request.id)
        names = dict.fromkeys(self._render_session.scenario_names)
        if request.scenario is not None and request.scenario not in names:
            errors.unknown_name("scenario", request.scenario, names, ErrorCode.NO_SCENARIO)
        owner = None if self._configured_by is None else self._sessions.present(self._configured_by)
        if owner is not None and owner.client != client:
            problem = f'"{owner.name}" chose the scenario; it has not left'
            code = ErrorCode.NOT_OWNER
            raise BadMessageError(code, "", problem, request.id, retryable=True)
        self._configured_by = client

        def configure() -> None:
            self._router.answer_or_refuse(
                client, lambda: self._configure(client, request), request.id
            )

        self._offer(client, request.id, configure)

    def _configure(self, client: bytes, request: Configure) -> None:
        try:
            self._render_session.configure(request.scenario, request.seed)
        except GpuLostError:
            raise
        except SimglError as error:
            code = ErrorCode.BAD_SCENE
            problem = self._render_session.without_folder(str(error))
            raise BadMessageError(code, "scenario", problem, request.id) from None
        if self._recorder is not None:
            session = self._render_session
            self._recorder.configured(request.scenario, session.scenario.seed, session.scene_hash)
        self._router.send(client, pack(self._welcome(request.id)))

    def _welcome(self, id: int | None) -> Welcome:
        return welcome(self._render_session, id=id, boot=self._boot, window=self._queue.window)

    def _statistics(self, id: int) -> Statistics:
        return Statistics(
            id=id,
            boot=self._boot,
            uptime_s=time.monotonic() - self._started,
            images=self._sequence,
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
        self._destroy(LINGER_MS)
        self._router.log.close()

    def _destroy(self, linger: int) -> None:
        if self._authenticator is not None:
            self._authenticator.stop()
        self._context.destroy(linger=linger)

    def __enter__(self) -> Simgl1Endpoint:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _payload(rendered: RenderedImages) -> list[memoryview]:
    """The planes as bytes, without a copy."""
    return [memoryview(plane.data).cast("B") for plane in rendered.pixels]
