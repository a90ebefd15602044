"""The Python client: it owns the time, sends a state and waits for the pictures of exactly that."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from typing import TypeVar

import zmq
from zmq.utils.monitor import recv_monitor_message

from simgl.errors import BridgeError
from simgl_bridge import multipart
from simgl_bridge.access import ClientKeys
from simgl_bridge.body_pose import BodyPose
from simgl_bridge.client_errors import NoAnswerError, RemoteError
from simgl_bridge.client_images import Image, Tick
from simgl_bridge.client_protocol import ClientProtocol, check_timeout, server_deadline_ms, shot_of
from simgl_bridge.connect import dial
from simgl_bridge.framing import pack
from simgl_bridge.messages import (
    Bye,
    Configure,
    Error,
    Images,
    Message,
    Next,
    Ping,
    Pong,
    Shot,
    State,
    Statistics,
    Stats,
    Welcome,
)

# States of the free-run that a client remembers, to check the pictures of them.
_STATES = 1024

_R = TypeVar("_R", bound=Message)


class Client:
    """A synchronous link to one server. Every wait ends after ``timeout_s``.

    Use it on one thread. Raises NoAnswerError where the server does not answer (at once where the
    connection breaks), RemoteError where it refuses, AccessError where keys do not fit, and
    BridgeError where a reply shows anything but what was asked for. After a NoAnswerError the same
    client goes on with its next request: it connects again by itself.

    >>> with Client("tcp://127.0.0.1:5563") as client:
    ...     image = client.render(client.welcome.epoch_tai_ns, "navcam")
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
        self._protocol = ClientProtocol(address)
        self._states: dict[int, State] = {}
        self._context = zmq.Context()
        try:
            self._socket, self._monitor = dial(self._context, address, name, keys)
            self._poller = zmq.Poller()
            self._poller.register(self._socket, zmq.POLLIN)
            self._poller.register(self._monitor, zmq.POLLIN)
            self._protocol.greeted(self._ask(self._protocol.hello(name), Welcome, None)[0])
        except BaseException:
            self._context.destroy(linger=0)
            raise

    @property
    def welcome(self) -> Welcome:
        """What the server said of itself: cameras, bodies, seed, window."""
        return self._protocol.welcome

    @property
    def restarts(self) -> int:
        """Times that the server was restarted with the same scene since this client connected."""
        return self._protocol.restarts

    def ping(self) -> float:
        """Round-trip time [s]."""
        id = self._protocol.next_id()
        start = time.perf_counter()
        self._ask(Ping(id=id), Pong, id)
        return time.perf_counter() - start

    def stats(self) -> Statistics:
        """What the server counted."""
        id = self._protocol.next_id()
        return self._ask(Stats(id=id), Statistics, id)[0]

    def configure(self, scenario: str | None = None, seed: int | None = None) -> Welcome:
        """Another scenario of the server's folder, or another seed, for all its clients."""
        id = self._protocol.next_id()
        reply, _ = self._ask(Configure(id=id, scenario=scenario, seed=seed), Welcome, id)
        self._protocol.greeted(reply)
        return reply

    def render(
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
        retry: bool = False,
    ) -> Image:
        """The picture that one camera takes of a state; see ``render_all``.

        exposure_time_s, gain_dn_per_e : None takes the camera's own
        products : of "dn", "radiance", "electrons", "depth", "part_id"
        """
        tick = self.render_all(
            tai_ns,
            [shot_of(camera, exposure_time_s, gain_dn_per_e, products)],
            bodies,
            sun_position_m=sun_position_m,
            lamps=lamps,
            moving=moving,
            seek=seek,
            retry=retry,
        )
        return tick[camera]

    def render_all(
        self,
        tai_ns: int,
        cameras: Sequence[Shot],
        bodies: Mapping[str, BodyPose] | None = None,
        *,
        sun_position_m: Sequence[float] | None = None,
        lamps: Mapping[str, float] | None = None,
        moving: bool = False,
        seek: bool = False,
        retry: bool = False,
    ) -> Tick:
        """The pictures that several cameras take of one state.

        tai_ns : mid-exposure, a whole number (a float would lose nanoseconds)
        bodies : spacecraft left out follow the scenario's own laws
        sun_position_m : (3,) Earth-centred ICRF; None leaves the Sun to the scenario
        lamps : lamp to the share of its power that it burns with, 0 to 1; others burn fully
        moving : bodies go on with their rates while the shutter is open: motion blur
        seek : allow a time before that of the last request
        retry : ask once more, with another ``timeout_s``, where no answer comes; a server that is
            still there renders once
        """
        attempts = 2 if retry else 1
        request = self._protocol.render(
            tai_ns,
            cameras,
            bodies,
            sun_position_m,
            seek,
            server_deadline_ms(self.timeout_s, attempts),
            lamps,
            moving,
        )
        images, payload = self._ask(request, Images, request.id, attempts)
        return self._protocol.shown(request, images, payload)

    def send_state(
        self,
        tai_ns: int,
        cameras: Sequence[Shot],
        bodies: Mapping[str, BodyPose] | None = None,
        *,
        sun_position_m: Sequence[float] | None = None,
        lamps: Mapping[str, float] | None = None,
        moving: bool = False,
    ) -> int:
        """Free-run: the newest state, without waiting; returns its id.

        A state that the server refuses is raised by the next call that waits.
        """
        self._check_open()
        state = self._protocol.state(tai_ns, cameras, bodies, sun_position_m, lamps, moving)
        self._router(state, time.monotonic() + self.timeout_s)
        self._states[state.id] = state
        if len(self._states) > _STATES:
            del self._states[next(iter(self._states))]
        return state.id

    def next_images(self, after: int = 0) -> Tick:
        """Free-run: the pictures of a state newer than those of sequence ``after``.

        They say which state they show, and how many states went by unseen.
        """
        id = self._protocol.next_id()
        request = Next(id=id, after=after, deadline_ms=server_deadline_ms(self.timeout_s))
        images, payload = self._ask(request, Images, id)
        state = self._states.get(images.state_id) if images.state_id is not None else None
        # The state may be another client's, or older than what is remembered.
        if state is None or state.tai_ns != images.tai_ns:
            return self._protocol.unverified(images, payload)
        return self._protocol.shown(state, images, payload)

    def _ask(
        self, message: Message, kind: type[_R], id: int | None, attempts: int = 1
    ) -> tuple[_R, Sequence[memoryview]]:
        """The reply of a kind to a message, with its payload frames."""
        for attempt in range(attempts):
            try:
                return self._ask_once(message, kind, id)
            except NoAnswerError:
                if attempt + 1 == attempts:
                    raise
        raise AssertionError("no attempt was made")

    def _ask_once(
        self, message: Message, kind: type[_R], id: int | None
    ) -> tuple[_R, Sequence[memoryview]]:
        self._check_open()
        deadline = time.monotonic() + self.timeout_s
        self._settle()
        self._router(message, deadline)
        while True:
            broke = self._wait_for_reply(deadline)
            # What came before a break counts: read first.
            while received := self._receive():
                reply, payload = received
                if isinstance(reply, Bye):
                    raise self._protocol.no_answer("the server said goodbye", message)
                if isinstance(reply, Error) and self._concerns(reply, id, message):
                    raise RemoteError(self.address, reply)
                if isinstance(reply, kind) and getattr(reply, "id", None) == id:
                    return reply, payload
            if broke:
                raise self._protocol.no_answer("the connection broke", message)
            if time.monotonic() >= deadline:
                raise self._protocol.timed_out(message, self.timeout_s)

    def _concerns(self, error: Error, id: int | None, message: Message) -> bool:
        """Whether an error is about the open request, or a state that was sent before it."""
        # An error without id belongs to the only request that is open.
        return error.id in (id, None) or (isinstance(message, Next) and error.id in self._states)

    def _check_open(self) -> None:
        if self._context.closed:
            raise BridgeError(f"{self.address}: this client is closed")

    def _settle(self) -> None:
        """Take in what happened since the last request; late replies are dropped."""
        if not self._poller.poll(0):
            return
        self._heed_events()
        while received := self._receive():
            reply, _ = received
            if isinstance(reply, Error) and reply.id in self._states:
                raise RemoteError(self.address, reply)

    def _heed_events(self) -> bool:
        """Take in what became of the connection; whether it broke."""
        broke = False
        while self._monitor.poll(0):
            event = int(recv_monitor_message(self._monitor)["event"])
            broke = self._protocol.heed(event) or broke
        return broke

    def _router(self, message: Message, deadline: float) -> None:
        """Hand a message over; raises NoAnswerError where there is no room for it in time."""
        frames = pack(message)
        while True:
            try:
                multipart.send(self._socket, frames)
                return
            except zmq.Again:
                left = deadline - time.monotonic()
                if left <= 0.0 or not self._socket.poll(math.ceil(left * 1000.0), zmq.POLLOUT):
                    raise self._protocol.timed_out(message, self.timeout_s) from None

    def _receive(self) -> tuple[Message, Sequence[memoryview]] | None:
        """A message that has arrived; None where none has."""
        parts = [frame.buffer for frame in multipart.receive(self._socket)]
        return (self._protocol.opened(parts), parts[2:]) if parts else None

    def _wait_for_reply(self, deadline: float) -> bool:
        """Wait for a reply or the end of the connection; whether the connection broke."""
        broke = False
        while not broke and (left := deadline - time.monotonic()) > 0.0:
            ready = dict(self._poller.poll(math.ceil(left * 1000.0)))
            if self._monitor in ready:
                broke = self._heed_events()
            if self._socket in ready:
                break
        return broke

    def close(self) -> None:
        """Say goodbye and hang up, without waiting."""
        if self._context.closed:
            return
        if self._protocol.connected and self._socket.poll(0, zmq.POLLOUT):
            multipart.send(self._socket, pack(Bye()))
        # Time for the goodbye to leave; a server that is gone costs no more than this.
        self._context.destroy(linger=100)

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
