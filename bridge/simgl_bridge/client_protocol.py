"""The client's side of simgl/1 without sockets: requests, replies, retries and deadlines as data.

``Client`` and ``AsyncClient`` own a socket and a monitor of its connection and move data between
them and one ClientProtocol::

    protocol.open(call := Call(request, Images, timeout_s))
    while not call.done:
        frames = protocol.due(call)           # to be sent now, or None
        ...                                   # wait for the sockets, until call.wake_at at most
        protocol.handle_event(event)          # of the monitor
        protocol.handle_frames(frames)        # of a reply
    reply, payload = call.result()

Times are those of ``time.monotonic`` [s].
"""

from __future__ import annotations

import operator
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypedDict, Unpack

import zmq
from msgspec import structs

from simgl.errors import BridgeError
from simgl.lru_cache import LruCache
from simgl_bridge.body_pose import BodyPose, floats
from simgl_bridge.client_call import Call, Payload
from simgl_bridge.client_errors import AccessError, NoAnswerError, RemoteError
from simgl_bridge.client_images import ImageSet, images_of
from simgl_bridge.framing import BadMessageError, pack, unpack_reply
from simgl_bridge.hashes import state_hash
from simgl_bridge.message_parts import SentSun, ServerStatus, Shot
from simgl_bridge.messages import (
    Bye,
    Error,
    ErrorCode,
    Images,
    Message,
    Next,
    Ping,
    Pong,
    Render,
    State,
    Welcome,
)
from simgl_bridge.plane_compression import check_wanted
from simgl_bridge.sockets import HANDSHAKE_FAILURES

# Of the pings while a call waits; requests count from 1.
_PING_ID = 0
# States of the free-run that are remembered to verify their images.
MAX_STATES = 1024


class StateOptions(TypedDict, total=False):
    """Keywords of a request beyond time, cameras and bodies.

    sun_position_m : (3,) Earth-centred ICRF; None leaves the Sun to the scenario
    lamps : lamp to the fraction of its power, 0 to 1; lamps that are not listed have full power
    moving : bodies move with their rates while the shutter is open: motion blur
    draw : which of several images of this time; another number has other noise
    """

    sun_position_m: Sequence[float] | None
    lamps: Mapping[str, float] | None
    moving: bool
    draw: int


class RenderOptions(StateOptions, total=False):
    """Keywords of a lock-step request; those of StateOptions, and:

    seek : allow a time before that of the last request
    compression : of the planes on their way, "zstd" or none; what arrives has the same bytes
    thermal_from : ``thermal_state`` of the image before: temperatures go on from there
    """

    seek: bool
    compression: str
    thermal_from: str


def shot_of(
    camera: str,
    exposure_time_s: float | None,
    gain_dn_per_e: float | None,
    products: Sequence[str],
) -> Shot:
    """The request to one camera; None takes the camera's own value."""
    return Shot(
        camera=camera,
        exposure_time_s=None if exposure_time_s is None else float(exposure_time_s),
        gain_dn_per_e=None if gain_dn_per_e is None else float(gain_dn_per_e),
        products=tuple(products),
    )


class ClientProtocol:
    """Makes requests, matches and verifies replies, and remembers the server.

    on_status : called with each status of the server that arrives while a call waits
    welcome : the last one
    status : what the server last said that it does; None before that
    restarts : times that another server process of the same scene answered
    connected : whether the handshake of the connection is done
    """

    welcome: Welcome

    def __init__(
        self, address: str, on_status: Callable[[ServerStatus], object] | None = None
    ) -> None:
        self.address = address
        self._on_status = on_status
        self.status: ServerStatus | None = None
        self.restarts = 0
        self.connected = False
        self._was_admitted = False
        self._boot = ""
        self._last_id = 0
        self._last_sequence: int | None = None
        self._last_heard: float | None = None
        self._calls: dict[int | None, Call[Any]] = {}
        self._states: LruCache[int, State] = LruCache(MAX_STATES)
        # Of a state, or of the client's identity, when no call could be told.
        self._refusal: RemoteError | None = None

    # Requests

    def next_id(self) -> int:
        """An id that was not used before."""
        self._last_id += 1
        return self._last_id

    def render(
        self,
        tai_ns: int,
        cameras: Sequence[Shot],
        bodies: Mapping[str, BodyPose] | None,
        deadline_ms: int | None,
        *,
        seek: bool = False,
        compression: str = "",
        thermal_from: str = "",
        **options: Unpack[StateOptions],
    ) -> Render:
        """A lock-step request; ConfigError for a compression that this client cannot undo."""
        check_wanted(compression)
        state = structs.asdict(self.state(tai_ns, cameras, bodies, **options))
        return Render(
            seek=seek,
            deadline_ms=deadline_ms,
            compression=compression,
            thermal_from=thermal_from,
            **state,
        )

    def state(
        self,
        tai_ns: int,
        cameras: Sequence[Shot],
        bodies: Mapping[str, BodyPose] | None,
        *,
        sun_position_m: Sequence[float] | None = None,
        lamps: Mapping[str, float] | None = None,
        moving: bool = False,
        draw: int = 0,
    ) -> State:
        """A state of the free-run; ``remember`` it to verify its images."""
        sun = None if sun_position_m is None else floats("sun_position_m", sun_position_m, 3)
        return State(
            id=self.next_id(),
            tai_ns=_integer(tai_ns),
            cameras=tuple(cameras),
            bodies={name: pose.as_sent() for name, pose in (bodies or {}).items()},
            sun=None if sun is None else SentSun(position_m=(sun[0], sun[1], sun[2])),
            lamps={name: float(share) for name, share in (lamps or {}).items()},
            moving=moving,
            draw=_integer(draw),
        )

    def remember(self, state: State) -> None:
        """Keep a state that was sent, to verify its images."""
        self._states.get(state.id, lambda: state)

    # Calls

    def open(self, call: Call[Any]) -> None:
        """Begin a call, which ``close`` ends; it fails at once for what was refused before."""
        self._calls[call.id] = call
        if self._refusal is not None:
            call.fail(self._refusal)
            self._refusal = None

    def close(self, call: Call[Any]) -> None:
        """Forget a call; a reply that comes late is dropped."""
        self._calls.pop(call.id, None)

    def due(self, call: Call[Any]) -> list[bytes] | None:
        """Frames to be sent now: the request, or a ping; a call fails at its deadline."""
        now = time.monotonic()
        if call.done or now < call.wake_at:
            return None
        if call.sent:
            if now < call.deadline and now < call.heard + call.timeout_s:
                call.wake_at = call.next_wake(now)
                # Without a connection pings would only fill the queue.
                return pack(Ping(id=_PING_ID)) if self.connected else None
            call.fail(self._given_up(call))
            if call.done:
                return None
        call.sent, call.wake_at = True, call.next_wake(now)
        return pack(call.request)

    def _given_up(self, call: Call[Any]) -> NoAnswerError:
        if call.patience_s is None or time.monotonic() < call.deadline:
            return self.timed_out(call.request, call.timeout_s)
        status = self.status
        doing = "" if status is None else f" ({' '.join([status.state, status.detail]).strip()})"
        return self._no_answer(f"not done within {call.patience_s:g} s{doing}", call.request)

    def handle_frames(self, frames: Sequence[memoryview]) -> None:
        """Hand a message that arrived to the call that it answers; others are dropped."""
        self._last_heard = time.monotonic()
        for waiting in self._open_calls():
            waiting.heard = self._last_heard
        try:
            reply = unpack_reply(frames)
        except BadMessageError as error:
            problem = f"the server sent an invalid message: {error}"
            self._fail_all(BridgeError(f"{self.address}: {problem}"))
            return
        id = getattr(reply, "id", None)
        if isinstance(reply, Pong | Welcome) and reply.status is not None:
            self._take_status(reply.status)
        if isinstance(reply, Bye):
            self._fail_sent("the server said goodbye")
        elif isinstance(reply, Error):
            self._handle_error(reply)
        elif (call := self._calls.get(id)) is None or call.done:
            return
        elif isinstance(reply, call.reply_type):
            if isinstance(reply, Welcome):
                self.welcome, self._boot = reply, reply.boot
            call.reply = reply, frames[2:]
            call.on_change()
        else:
            call.fail(BridgeError(f"{self.address}: answered {type(reply).__name__.lower()}"))

    def _take_status(self, status: ServerStatus) -> None:
        self.status = status
        if self._on_status is not None:
            self._on_status(status)

    def _handle_error(self, reply: Error) -> None:
        error = RemoteError(self.address, reply)
        refused = reply.id is not None and self._states.find(reply.id) is not None
        shared_identity = reply.code == ErrorCode.SHARED_IDENTITY
        reported = False
        for call in self._open_calls():
            # Without an id the server could not tell which request it was: none must wait in vain.
            if reply.id is None or reply.id == call.id:
                concerned = call.sent or shared_identity
            else:
                # A refused state is reported by the next call that waits.
                concerned = refused and (isinstance(call.request, Next) or not call.sent)
            if concerned:
                call.fail(error)
                reported = True
        if (refused or shared_identity) and not reported:
            self._refusal = error

    def handle_event(self, event: int) -> bool:
        """Process an event of the socket's monitor; whether the connection broke.

        Replies that arrived before the break count: read them before ``handle_break``.
        """
        # A server that ends during a handshake fails it without detail, as one that does not accept
        # the keys does: for a client that was admitted before, it is a broken connection.
        cut_off = event == zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL and self._was_admitted
        if event & HANDSHAKE_FAILURES and not cut_off:
            problem = (
                f"{self.address}: the server refused this client: its key, or the server's, is "
                "missing or wrong, or the client is not on the server's list"
            )
            self._fail_all(AccessError(problem))
            return False
        broke = event == zmq.EVENT_DISCONNECTED and self.connected
        self.connected = event == zmq.EVENT_HANDSHAKE_SUCCEEDED
        self._was_admitted = self._was_admitted or self.connected
        return broke

    def handle_break(self) -> None:
        """Fail the calls that were sent over a connection that broke; ZeroMQ connects again."""
        self._fail_sent("the connection broke")

    def timed_out(self, request: Message, timeout_s: float) -> NoAnswerError:
        """The error of a request at its deadline."""
        what = "no answer" if self.connected else "no connection"
        return self._no_answer(f"{what} within {timeout_s:g} s", request)

    def _no_answer(self, reason: str, request: Message) -> NoAnswerError:
        age = None if self._last_heard is None else time.monotonic() - self._last_heard
        asked = type(request).__name__.lower()
        return NoAnswerError(self.address, reason, asked, age, self._last_sequence)

    def _open_calls(self) -> list[Call[Any]]:
        return [call for call in self._calls.values() if not call.done]

    def _fail_sent(self, reason: str) -> None:
        for call in self._open_calls():
            if call.sent:
                call.fail(self._no_answer(reason, call.request))

    def _fail_all(self, error: BridgeError) -> None:
        for call in self._open_calls():
            call.fail(error)

    # Images

    def images(self, request: Render | State, reply: Images, payload: Payload) -> ImageSet:
        """The images of a reply; raises BridgeError unless they show the state asked for."""
        self._check_scene(reply)
        expected = state_hash(
            tai_ns=request.tai_ns,
            bodies=request.bodies,
            sun=request.sun,
            cameras=[self._as_used(shot) for shot in request.cameras],
            seed=self.welcome.seed,
            lamps=request.lamps,
            moving=request.moving,
            draw=request.draw,
            thermal_from=request.thermal_from if isinstance(request, Render) else "",
        )
        if (reply.tai_ns, reply.state_hash) != (request.tai_ns, expected):
            raise BridgeError(
                f"{self.address}: image {reply.sequence} shows another state than request "
                f"{request.id}: {reply.tai_ns} ns, hash {reply.state_hash}; "
                f"asked for {request.tai_ns} ns, hash {expected}"
            )
        return self._unpacked(reply, payload)

    def streamed_images(self, reply: Images, payload: Payload) -> ImageSet:
        """The images of a free-run reply, verified where this client sent the state."""
        state = None if reply.state_id is None else self._states.find(reply.state_id)
        # It may be another client's state, or older than what is remembered.
        if state is None or state.tai_ns != reply.tai_ns:
            return self._unpacked(reply, payload)
        return self.images(state, reply, payload)

    def _unpacked(self, reply: Images, payload: Payload) -> ImageSet:
        try:
            images = images_of(reply, payload)
        except BridgeError as error:
            raise BridgeError(f"{self.address}: {error}") from None
        self._last_sequence = reply.sequence
        return images

    def _check_scene(self, reply: Images) -> None:
        known = (self.welcome.scene_hash, self.welcome.seed)
        if (reply.scene_hash, reply.seed) != known:
            raise BridgeError(
                f"{self.address}: the server shows another scene now, {reply.scene_hash} with "
                f"seed {reply.seed} instead of {known[0]} with seed {known[1]}; connect again"
            )
        if reply.boot != self._boot:
            # Restarted with the same scene: an image depends on nothing else.
            self._boot = reply.boot
            self.restarts += 1

    def _as_used(self, shot: Shot) -> tuple[str, float, float]:
        camera = next(c for c in self.welcome.cameras if c.name == shot.camera)
        exposure, gain = shot.exposure_time_s, shot.gain_dn_per_e
        return (
            shot.camera,
            camera.exposure_time_s if exposure is None else exposure,
            camera.gain_dn_per_e if gain is None else gain,
        )


def _integer(tai_ns: int) -> int:
    try:
        return operator.index(tai_ns)
    except TypeError:
        problem = "must be a whole number of nanoseconds"
        raise TypeError(f"tai_ns {problem}, got {tai_ns!r}") from None
