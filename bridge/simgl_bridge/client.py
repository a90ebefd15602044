"""The synchronous Python client: it drives simulation time and waits for the images of a state."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, TypeVar, Unpack

import zmq
from zmq.utils.monitor import recv_monitor_message

from simgl.errors import BridgeError
from simgl_bridge.access import ClientKeys
from simgl_bridge.body_pose import BodyPose
from simgl_bridge.client_images import Image, ImageSet
from simgl_bridge.client_protocol import (
    READY_TIMEOUT,
    SILENCE,
    Call,
    ClientProtocol,
    Payload,
    RenderOptions,
    StateOptions,
    check_timeouts,
    open_call,
    server_deadline_ms,
    shot_of,
)
from simgl_bridge.framing import VERSION, pack
from simgl_bridge.messages import (
    Bye,
    Configure,
    Hello,
    Images,
    Message,
    Next,
    Ping,
    Pong,
    ServerStatus,
    Shot,
    Statistics,
    Stats,
    Welcome,
)
from simgl_bridge.sockets import connect, receive, send

_Reply = TypeVar("_Reply", bound=Message)


class PendingImages:
    """The images of a request under way, from ``Client.submit``.

    is_done : receives what has arrived; whether there is a result
    finish : waits for the images
    """

    def __init__(self, is_done: Callable[[], bool], finish: Callable[[], ImageSet]) -> None:
        self._is_done, self._finish = is_done, finish
        self._images: ImageSet | None = None

    @property
    def done(self) -> bool:
        """Whether ``result`` answers, or raises, at once."""
        return self._is_done()

    def result(self) -> ImageSet:
        """The images, once they are there; raises as ``Client.render_all`` does."""
        if self._images is None:
            self._images = self._finish()
        return self._images


class Client:
    """A synchronous connection to one server. Every wait ends.

    timeout_s : of every call once the server is ready; a request is then refused as too late. None
        waits for an image as long as the server says that it works on it, an hour at most, and
        gives up a server that says nothing for 10 s
    ready_timeout_s : for a server that is starting
    on_status : called with the server's status while a call waits: what is prepared, and how far

    Use it on one thread. Raises NoAnswerError where the server does not answer (at once where the
    connection breaks), RemoteError where it refuses, AccessError where keys do not fit, and
    BridgeError where a reply shows anything but what was asked for. After a NoAnswerError the
    client can be used on: it connects again with the next request.

    >>> with Client("tcp://127.0.0.1:5563") as client:
    ...     image = client.render(client.welcome.epoch_tai_ns, "navcam")
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
        self._protocol = ClientProtocol(address, on_status)
        self._context = zmq.Context()
        try:
            self._socket, self._monitor = connect(self._context, address, name, keys)
            self._poller = zmq.Poller()
            self._poller.register(self._socket, zmq.POLLIN)
            self._poller.register(self._monitor, zmq.POLLIN)
            self._ready_timeout_s = ready_timeout_s
            self._under_way: list[Call[Images]] = []
            self._call(Hello(client=name, versions=(VERSION,)), Welcome)
        except BaseException:
            self._context.destroy(linger=0)
            raise

    @property
    def welcome(self) -> Welcome:
        """The server's description of itself: cameras, bodies, seed, window."""
        return self._protocol.welcome

    @property
    def restarts(self) -> int:
        """Times that the server was restarted with the same scene since this client connected."""
        return self._protocol.restarts

    def status(self) -> ServerStatus | None:
        """What the server is doing now; None from one of an older version."""
        return self._call(Ping(id=self._protocol.next_id()), Pong)[0].status

    def ping(self) -> float:
        """Round-trip time [s]."""
        start = time.perf_counter()
        self._call(Ping(id=self._protocol.next_id()), Pong)
        return time.perf_counter() - start

    def stats(self) -> Statistics:
        """The server's counters."""
        return self._call(Stats(id=self._protocol.next_id()), Statistics)[0]

    def configure(self, scenario: str | None = None, seed: int | None = None) -> Welcome:
        """Choose another scenario of the server's folder, or another seed, for all its clients."""
        request = Configure(id=self._protocol.next_id(), scenario=scenario, seed=seed)
        return self._call(request, Welcome)[0]

    def render(
        self,
        tai_ns: int,
        camera: str,
        bodies: Mapping[str, BodyPose] | None = None,
        exposure_time_s: float | None = None,
        products: Sequence[str] = ("dn",),
        *,
        gain_dn_per_e: float | None = None,
        retry: bool = False,
        **options: Unpack[RenderOptions],
    ) -> Image:
        """The image that one camera takes of a state; see ``render_all`` for the other parameters.

        exposure_time_s, gain_dn_per_e : None takes the camera's own
        products : of ``welcome.products``
        """
        shots = [shot_of(camera, exposure_time_s, gain_dn_per_e, products)]
        return self.render_all(tai_ns, shots, bodies, retry=retry, **options)[camera]

    def render_all(
        self,
        tai_ns: int,
        cameras: Sequence[Shot],
        bodies: Mapping[str, BodyPose] | None = None,
        *,
        retry: bool = False,
        **options: Unpack[RenderOptions],
    ) -> ImageSet:
        """The images that several cameras take of one state.

        tai_ns : mid-exposure, an integer (a float would lose nanoseconds)
        bodies : spacecraft left out follow the scenario's own laws
        retry : send the request once more, with another ``timeout_s``, where no answer comes, or
            the server lost its renderer or GPU over it; one that is still running renders once
        sun_position_m : (3,) Earth-centred ICRF; None leaves the Sun to the scenario
        lamps : lamp to the share of its power that it burns with, 0 to 1; others burn fully
        moving : bodies move with their rates while the shutter is open: motion blur
        draw : which of several images of this time; another number has other noise
        seek : allow a time before that of the last request
        compression : "zstd" for a link between machines; the images are the same
        thermal_from : of thermal cameras ``thermal_state`` of the image before: temperatures go on
            from there; without it they are those of the steady state
        """
        self._make_room()
        attempts = 2 if retry else 1
        deadline_ms = server_deadline_ms(self.timeout_s, attempts)
        request = self._protocol.render(tai_ns, cameras, bodies, deadline_ms, **options)
        return self._protocol.images(request, *self._call(request, Images, attempts))

    def submit(
        self,
        tai_ns: int,
        cameras: Sequence[Shot],
        bodies: Mapping[str, BodyPose] | None = None,
        **options: Unpack[RenderOptions],
    ) -> PendingImages:
        """Send a request without waiting: the next one may follow while its images are drawn.

        Parameters are those of ``render_all``, without ``retry``. The server works in the order of
        the requests, and one that it refuses does not touch the others. ``timeout_s`` counts from
        here, so it covers the requests before. At most ``welcome.window`` are under way: a further
        one waits for the first of them.
        """
        self._make_room()
        deadline_ms = server_deadline_ms(self.timeout_s)
        request = self._protocol.render(tai_ns, cameras, bodies, deadline_ms, **options)
        call = self._begin(request, Images)
        self._under_way.append(call)
        self._move(call)
        return PendingImages(
            partial(self._is_done, call),
            lambda: self._protocol.images(request, *self._finish(call)),
        )

    def _make_room(self) -> None:
        """Wait until one more request fits into the server's window."""
        under_way, self._under_way = self._under_way, []
        for call in under_way:
            if self._is_done(call):
                self._protocol.close(call)
            else:
                self._under_way.append(call)
        while len(self._under_way) >= self.welcome.window:
            self._wait(self._under_way.pop(0))

    def _is_done(self, call: Call[Any]) -> bool:
        if not call.done and not self._context.closed:
            self._receive(0.0)
        return call.done

    def send_state(
        self,
        tai_ns: int,
        cameras: Sequence[Shot],
        bodies: Mapping[str, BodyPose] | None = None,
        **options: Unpack[StateOptions],
    ) -> int:
        """Free-run: send the newest state without waiting; returns its id.

        Parameters are those of ``render_all``, without ``seek``. A state that the server refuses is
        raised by the next call that waits.
        """
        self._check_open()
        state = self._protocol.state(tai_ns, cameras, bodies, **options)
        timeout_s = SILENCE if self.timeout_s is None else self.timeout_s
        if not self._send(pack(state), time.monotonic() + timeout_s):
            raise self._protocol.timed_out(state, timeout_s)
        self._protocol.remember(state)
        return state.id

    def next_images(self, after: int = 0) -> ImageSet:
        """Free-run: the images of a state newer than those of sequence ``after``.

        They name the state that they show, and count the states that were skipped.
        """
        deadline_ms = server_deadline_ms(SILENCE if self.timeout_s is None else self.timeout_s)
        request = Next(id=self._protocol.next_id(), after=after, deadline_ms=deadline_ms)
        return self._protocol.streamed_images(*self._call(request, Images))

    def _call(
        self, request: Message, reply_type: type[_Reply], attempts: int = 1
    ) -> tuple[_Reply, Payload]:
        """The reply to a request, with its payload frames."""
        return self._finish(self._begin(request, reply_type, attempts))

    def _begin(self, request: Message, reply_type: type[_Reply], attempts: int = 1) -> Call[_Reply]:
        self._check_open()
        call = open_call(request, reply_type, self.timeout_s, self._ready_timeout_s, attempts)
        # Late replies and events since the last call.
        self._receive(0.0)
        self._protocol.open(call)
        return call

    def _finish(self, call: Call[_Reply]) -> tuple[_Reply, Payload]:
        try:
            # What came while nobody waited counts, however late it is now.
            if not self._is_done(call):
                self._check_open()
            self._wait(call)
        finally:
            self._protocol.close(call)
        return call.result()

    def _wait(self, call: Call[Any]) -> None:
        """Until a call has its reply or its error."""
        while not call.done:
            self._move(call)
            self._receive(call.wake_at - time.monotonic())

    def _move(self, call: Call[Any]) -> None:
        """Send what is due of a call."""
        if frames := self._protocol.due(call):
            self._send(frames, time.monotonic() + call.timeout_s)

    def _check_open(self) -> None:
        if self._context.closed:
            raise BridgeError(f"{self.address}: this client is closed")

    def _receive(self, timeout_s: float) -> None:
        """Receive what has arrived, or arrives in time, from the server and the monitor."""
        ready = dict(self._poller.poll(math.ceil(max(timeout_s, 0.0) * 1000.0)))
        broke = False
        while self._monitor in ready and self._monitor.poll(0):
            event = int(recv_monitor_message(self._monitor)["event"])
            broke = self._protocol.handle_event(event) or broke
        while ready and (frames := receive(self._socket)):
            self._protocol.handle_frames([frame.buffer for frame in frames])
        if broke:
            self._protocol.handle_break()

    def _send(self, frames: list[bytes], deadline: float) -> bool:
        """Send a message; False where the queue stays full until a deadline."""
        while True:
            try:
                send(self._socket, frames)
                return True
            except zmq.Again:
                left = deadline - time.monotonic()
                if left <= 0.0 or not self._socket.poll(math.ceil(left * 1000.0), zmq.POLLOUT):
                    return False

    def close(self) -> None:
        """Say goodbye and disconnect, without waiting."""
        if self._context.closed:
            return
        if self._protocol.connected and self._socket.poll(0, zmq.POLLOUT):
            send(self._socket, pack(Bye()))
        # Time to send the goodbye; a server that is gone costs no more than this.
        self._context.destroy(linger=100)

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
