"""The front of simgl/1: one ROUTER socket whose requests become pictures of a studio."""

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
from simgl_bridge.client_sessions import Session, Sessions
from simgl_bridge.describe_server import welcome
from simgl_bridge.fair_queue import FairQueue
from simgl_bridge.framing import VERSION, BadMessageError, pack, unpack_request
from simgl_bridge.free_run import Shown, Stream
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
from simgl_bridge.render_request import Pictures, take_pictures
from simgl_bridge.render_session import GpuLostError, RenderSession
from simgl_bridge.reply_cache import Frames, ReplyCache
from simgl_bridge.router_socket import RouterSocket
from simgl_bridge.state_hash import state_hash
from simgl_bridge.validate_request import FieldErrors, Wanted, check_id, check_request, check_wait

# Requests of one client that may wait: n + 1 is rendered while n travels.
WINDOW = 2
# Replies that may still be on their way when the server stops get this long [ms].
LINGER_MS = 2000
# The noise takes keys of 32 bits.
LARGEST_SEED = 2**32 - 1
# The name under which pictures of the free-running stream wait; no client can have it.
_STREAM = b""


class Simgl1Endpoint:
    """Answers simgl/1 at an address.

    turns : where its requests wait, beside those of other fronts
    monitor : address of the PUB socket with previews; None has none
    rate_hz : most pictures a second in free-run; None as many as can be

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
    ) -> None:
        self._render_session = render_session
        self._queue = queue
        self._boot = uuid.uuid4().hex
        self._started = time.monotonic()
        self._sequence = 0
        self._repeated = 0
        self._replies = ReplyCache()
        self._sessions = Sessions()
        self._stream = Stream(0.0 if rate_hz is None else 1.0 / rate_hz)
        self._configured_by: bytes | None = None
        self._context: zmq.Context[Any] = zmq.Context()
        self._doorkeeper = access.guard(self._context)
        try:
            self._router = RouterSocket(
                self._context, address, access, most_pixels=self._most_pixels, on_gone=self._leave
            )
            self.socket, self.address = self._router.socket, self._router.address
            self._monitor = None
            if monitor is not None:
                self._monitor = Monitor(self._context, monitor, access)
        except BaseException:
            self._destroy(0)
            raise

    @property
    def _most_pixels(self) -> int:
        detectors = [c.detector for c in self._render_session.scenario.cameras.values()]
        return max((d.width * d.height for d in detectors), default=1)

    @property
    def summary(self) -> str:
        """One line: where, with what, and what there is to see."""
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

    # Taking in

    def receive(self) -> None:
        """Take in what has arrived; what needs no picture is answered at once."""
        for client, frames in self._router.arrived():
            session = self._sessions.heard(client)
            self._router.guarded(client, partial(self._request, client, session, frames))

    def _leave(self, client: bytes) -> None:
        self._queue.drop(client)
        self._replies.forget(client)
        self._stream.forget(client)
        self._sessions.forget(client)
        if self._configured_by == client:
            self._configured_by = None

    def _request(self, client: bytes, session: Session, frames: list[bytes]) -> None:
        request = unpack_request(frames)
        if isinstance(request, Render):
            self._enqueue(client, session, request, frames[1])
        elif isinstance(request, State):
            self._accept(client, session, request)
        elif isinstance(request, Next):
            self._wait(client, request)
        elif isinstance(request, Configure):
            self._queue_configure(client, request)
        elif isinstance(request, Bye):
            self._leave(client)
        else:
            self._router.send(client, pack(self._quick_reply(client, session, request)))

    def _quick_reply(self, client: bytes, session: Session, request: Message) -> Message:
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

    def _enqueue(self, client: bytes, session: Session, request: Render, header: bytes) -> None:
        check_id(request.id)
        if kept := self._replies.find(client, request.id, header):
            self._repeated += 1
            self._router.send(client, kept)
            return
        # The reply to a request that waits already answers its repetition too.
        key = (request.id, header)
        if self._queue.waits(client, key):
            return
        arrived = time.monotonic()

        def render() -> None:
            self._router.guarded(
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
        self, client: bytes, session: Session, request: Render, header: bytes, arrived: float
    ) -> None:
        check_wait(request.id, request.deadline_ms)
        # Another request of this id may have been before it in the queue.
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
        pictures = take_pictures(self._render_session, request)
        session.last_tai_ns = request.tai_ns
        images = self._described(request, pictures)
        frames: Frames = [*pack(images), *_payload(pictures)]
        self._replies.keep(client, request.id, header, frames)
        self._router.send(client, frames)
        self._show(images, pictures)

    def _described(self, request: Wanted, pictures: Pictures) -> Images:
        self._sequence += 1
        seed = self._render_session.scenario.seed
        return Images(
            id=request.id,
            sequence=self._sequence,
            boot=self._boot,
            scene_hash=self._render_session.scene_hash,
            tai_ns=request.tai_ns,
            state_hash=state_hash(
                tai_ns=request.tai_ns,
                bodies=request.bodies,
                sun=request.sun,
                cameras=[(i.camera, i.exposure_time_s, i.gain_dn_per_e) for i in pictures.images],
                seed=seed,
                lamps=request.lamps,
                moving=request.moving,
            ),
            seed=seed,
            bodies=pictures.bodies,
            images=pictures.images,
        )

    def _show(self, images: Images, pictures: Pictures) -> None:
        if self._monitor is not None:
            self._monitor.show(images, pictures.digital)

    # Free-run

    def _accept(self, client: bytes, session: Session, state: State) -> None:
        check_request(self._render_session.scenario, state)
        if not self._stream.accept(client, session.name, state, time.monotonic()):
            owner = self._stream.owner_name
            problem = f'"{owner}" streams states here; it has not left'
            code = ErrorCode.NOT_OWNER
            raise BadMessageError(code, "", problem, state.id, retryable=True)

    def _wait(self, client: bytes, request: Next) -> None:
        check_id(request.id)
        check_wait(request.id, request.deadline_ms)
        if not self._stream.wait(client, request, time.monotonic()):
            problem = "too many clients wait for the next picture"
            raise BadMessageError(ErrorCode.BUSY, "", problem, request.id, retryable=True)
        self._answer_waiting()

    def tick(self, now: float) -> float:
        """Let the newest state wait its turn, and end waits whose deadline is over."""
        if self._stream.due(now) and not self._queue.waits(_STREAM, 0):
            self._queue.offer(_STREAM, 0, self._render_stream)
        for client, request in self._stream.overdue(now):
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
            pictures = take_pictures(self._render_session, state)
            images = self._described(state, pictures)
            images = msgspec.structs.replace(images, state_id=state.id, dropped=dropped)
            self._stream.shown = Shown(images, _payload(pictures))
            self._answer_waiting()
            self._show(images, pictures)

        self._router.guarded(owner, render, state.id)

    def _answer_waiting(self) -> None:
        shown = self._stream.shown
        for client, request in self._stream.answered():
            assert shown is not None
            images = msgspec.structs.replace(shown.images, id=request.id)
            self._router.send(client, [*pack(images), *shown.pixels])

    # The scene

    def _queue_configure(self, client: bytes, request: Configure) -> None:
        check_id(request.id)
        say = FieldErrors(request.id)
        if request.seed is not None and not 0 <= request.seed <= LARGEST_SEED:
            say.refuse("seed", f"must lie in 0..{LARGEST_SEED}, got {request.seed}")
        names = dict.fromkeys(self._render_session.scenario_names)
        if request.scenario is not None and request.scenario not in names:
            say.missing("scenario", request.scenario, names, ErrorCode.NO_SCENARIO)
        owner = self._configured_by
        if owner is not None and owner != client and self._sessions.is_here(owner):
            problem = f'"{self._sessions.name(owner)}" chose the scenario; it has not left'
            code = ErrorCode.NOT_OWNER
            raise BadMessageError(code, "", problem, request.id, retryable=True)
        self._configured_by = client

        def configure() -> None:
            self._router.guarded(client, lambda: self._change(client, request), request.id)

        self._offer(client, request.id, configure)

    def _change(self, client: bytes, request: Configure) -> None:
        try:
            self._render_session.configure(request.scenario, request.seed)
        except GpuLostError:
            raise
        except SimglError as error:
            code = ErrorCode.BAD_SCENE
            problem = self._render_session.as_in_folder(str(error))
            raise BadMessageError(code, "scenario", problem, request.id) from None
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
            clients=len(self._sessions.here()),
        )

    # The end

    def farewell(self) -> None:
        """Say Bye to every client heard of lately; requests that wait get no other answer."""
        for client in self._sessions.here():
            self._router.send(client, pack(Bye(boot=self._boot)))

    def close(self) -> None:
        """Give the address back once the last replies are out, at most two seconds later."""
        self._destroy(LINGER_MS)

    def _destroy(self, linger: int) -> None:
        if self._doorkeeper is not None:
            self._doorkeeper.stop()
        self._context.destroy(linger=linger)

    def __enter__(self) -> Simgl1Endpoint:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _payload(pictures: Pictures) -> list[memoryview]:
    """The planes as bytes, without a copy."""
    return [memoryview(plane.data).cast("B") for plane in pictures.pixels]
