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
from simgl_bridge.client_call import (
    READY_TIMEOUT,
    SILENCE,
    Call,
    Payload,
    check_timeouts,
    open_call,
    server_deadline_ms,
)
from simgl_bridge.client_images import Image, ImageSet
from simgl_bridge.client_protocol import (
    ClientProtocol,
    RenderOptions,
    StateOptions,
    shot_of,
)
from simgl_bridge.framing import VERSION, pack
from simgl_bridge.message_parts import ServerStatus, Shot
from simgl_bridge.messages import (
    Bye,
    Configure,
    Hello,
    Images,
    Message,
    Next,
    Ping,
    Pong,
    Statistics,
    Stats,
    Welcome,
)
from simgl_bridge.sockets import connect, receive, send

_Reply = TypeVar("_Reply", bound=Message)


class PendingImages:
    """The images of a pending request, from ``Client.submit``.

    is_done : receives arrived messages; returns whether there is a result
    finish : waits for the images
    """

    def __init__(self, is_done: Callable[[], bool], finish: Callable[[], ImageSet]) -> None:
        self._is_done, self._finish = is_done, finish
        self._images: ImageSet | None = None

    @property
    def done(self) -> bool:
        """Whether ``result`` returns, or raises, at once."""
        return self._is_done()

    def result(self) -> ImageSet:
        """Wait for the images; raises like ``Client.render_all``."""
        if self._images is None:
            self._images = self._finish()
        return self._images


class Client:
    """A synchronous connection to one server. Every call times out.

    address : of the server, ``tcp://HOST:PORT`` or ``ipc://PATH``
    timeout_s : limit of every call once the server is ready; the server then refuses the request as
        too late. With None a call waits for an image while the server reports that it is working,
        one hour at most, and gives up if the server is silent for 10 s
    ready_timeout_s : limit for a server that is starting
    name : of this client, for the server's messages to other clients
    keys : of this client, for a server that requires them
    on_status : called with the server's status while a call waits: current step and progress

    Use it on one thread. Raises NoAnswerError if the server does not answer (at once if the
    connection breaks), RemoteError if it refuses the request, AccessError for wrong keys, and
    BridgeError if a reply does not show the requested state. After a NoAnswerError the client
    remains usable: it connects again with the next request.

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
        """The server's current status; None from a server of an older version."""
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
        """Choose another scenario of the server's folder, or another seed, for all its clients.

        scenario : one of ``welcome.scenarios``; None keeps the present one
        seed : of all noise; None takes the scenario's own
        """
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
        """The image of one camera and one state.

        camera : its name
        exposure_time_s, gain_dn_per_e : the camera's values if None
        tai_ns, bodies, retry, options : as for ``render_all``
        products : names from ``welcome.products``
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
        """The images of several cameras and one state.

        tai_ns : mid-exposure, an integer (a float would lose nanoseconds)
        cameras : what each camera is asked for
        bodies : spacecraft to pose; spacecraft that are not listed follow the scenario's laws
        retry : send the request a second time, with a new ``timeout_s``, if no answer comes or the
            server lost its renderer or GPU; a request that is still running is rendered once
        sun_position_m : (3,) Earth-centred ICRF; the scenario's Sun if None
        lamps : lamp to the fraction of its power, 0 to 1; lamps that are not listed have full power
        moving : bodies move with their rates during the exposure: motion blur, rolling shutter
        draw : distinguishes images of one time; each draw has its own noise
        seek : allow a time before that of the last request
        compression : "zstd" for a link between machines; the images are the same
        thermal_from : for thermal cameras, ``thermal_state`` of an earlier image: temperatures
            continue from there. Without it they are those of the steady state
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
        """Send a request without waiting, so that the next one can follow while it is rendered.

        tai_ns, cameras, bodies, options : as for ``render_all``

        The server renders requests in order; a refused request does not affect the others.
        ``timeout_s`` starts at this call and therefore includes earlier requests. At most
        ``welcome.window`` requests are pending: a further one waits for the first of them.
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

        tai_ns, cameras, bodies, options : as for ``render_all``, without ``seek``, ``compression``
            and ``thermal_from``

        If the server refuses the state, the next call that waits raises the error.
        """
        self._check_open()
        state = self._protocol.state(tai_ns, cameras, bodies, **options)
        timeout_s = SILENCE if self.timeout_s is None else self.timeout_s
        if not self._send(pack(state), time.monotonic() + timeout_s):
            raise self._protocol.timed_out(state, timeout_s)
        self._protocol.remember(state)
        return state.id

    def next_images(self, after: int = 0) -> ImageSet:
        """Free-run: the next images.

        after : sequence of the last images that this client has

        They contain the id of their state, and the number of skipped states.
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
            # A reply that arrived before this call counts, even after the deadline.
            if not self._is_done(call):
                self._check_open()
            self._wait(call)
        finally:
            self._protocol.close(call)
        return call.result()

    def _wait(self, call: Call[Any]) -> None:
        """Wait until a call has its reply or its error."""
        while not call.done:
            self._move(call)
            self._receive(call.wake_at - time.monotonic())

    def _move(self, call: Call[Any]) -> None:
        """Send the messages of a call that are due."""
        if frames := self._protocol.due(call):
            self._send(frames, time.monotonic() + call.timeout_s)

    def _check_open(self) -> None:
        if self._context.closed:
            raise BridgeError(f"{self.address}: this client is closed")

    def _receive(self, timeout_s: float) -> None:
        """Receive messages of the server and the monitor, up to a timeout."""
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
        """Send a message; False if the queue is still full at the deadline."""
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
