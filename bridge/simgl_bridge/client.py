"""The Python client: it owns the time, sends a state and waits for the picture of exactly that."""

from __future__ import annotations

import math
import operator
import time
import uuid
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
import zmq
from numpy.typing import NDArray
from zmq.utils.monitor import recv_monitor_message

from simgl.errors import BridgeError, ConfigError
from simgl_bridge.messages import (
    Bye,
    Error,
    Hello,
    Images,
    Message,
    Ping,
    Plane,
    Pong,
    Quaternion,
    Render,
    Vector,
    Welcome,
    state_hash,
)
from simgl_bridge.pose import BodyPose
from simgl_bridge.wire import VERSION, BadMessageError, pack, unpack_reply

# The largest plane: radiance of 16384 x 16384 pixels.
LARGEST_FRAME = 16384 * 16384 * 16
# Requests and replies that may wait; a lock-step client needs one of each.
QUEUE = 4
# What a plane may hold.
DTYPES = ("<u2", "<u4", "<f4")

_R = TypeVar("_R", bound=Message)


class RemoteError(BridgeError):
    """The server refused a request.

    code : see ``messages.ErrorCode``
    field : such as ``bodies.chaser.position_m``
    detail : one line that names field, value and what is allowed
    retryable : whether the same request may succeed later
    """

    def __init__(self, address: str, error: Error) -> None:
        self.code = error.code
        self.field = error.field
        self.detail = error.detail
        self.retryable = error.retryable
        super().__init__(f"{address}: {error.code}: {error.detail}")


@dataclass(frozen=True, kw_only=True, eq=False)
class Image:
    """A picture and the state that it shows.

    planes : product to pixels, row 0 at the top; read-only
    sequence : of pictures taken by the server
    tai_ns : mid-exposure
    camera_position_m : of the pinhole, Earth-centred ICRF
    q_camera_from_icrf_xyzw : camera axes are z boresight, x right, y down
    intrinsics : (3, 3) from camera axes to pixel coordinates
    saturated_pixels : None where no digital numbers were asked for
    render_time_s : spent by the server on the picture
    part_names : part id to "spacecraft/part", where part ids were asked for
    """

    planes: Mapping[str, NDArray[Any]]
    sequence: int
    tai_ns: int
    state_hash: str
    camera: str
    camera_position_m: Vector
    q_camera_from_icrf_xyzw: Quaternion
    exposure_time_s: float
    intrinsics: NDArray[np.float64]
    seed: int
    saturated_pixels: int | None
    render_time_s: float
    part_names: Mapping[int, str]

    @property
    def dn(self) -> NDArray[np.uint16]:
        """(height, width) digital numbers; a BridgeError where they were not asked for."""
        if "dn" not in self.planes:
            raise BridgeError(f'this image has no "dn", only {", ".join(self.planes)}')
        return self.planes["dn"]


class Client:
    """A synchronous link to one server. Every wait ends after ``timeout_s``.

    Use it on one thread. Raises BridgeError where the server does not answer, answers another
    question or was restarted, and RemoteError where it refuses.

    >>> with Client("tcp://127.0.0.1:5563") as client:
    ...     image = client.render(client.welcome.epoch_tai_ns, "navcam")
    """

    def __init__(self, address: str, *, timeout_s: float = 10.0, name: str = "client") -> None:
        if not 0.0 < timeout_s < math.inf:
            raise ConfigError("Client", "timeout_s", f"must be finite, above 0 s, got {timeout_s}")
        self.address = address
        self.timeout_s = timeout_s
        self._last_id = 0
        self._last_sequence: int | None = None
        self._connection = False
        self._context = zmq.Context()
        try:
            self._socket = self._open_socket(name)
            self.welcome = self._hello(name)
        except BaseException:
            self._context.destroy(linger=0)
            raise

    def _open_socket(self, name: str) -> zmq.Socket[bytes]:
        s = self._context.socket(zmq.DEALER)
        # Two clients of one name must not take over each other's place.
        s.setsockopt(zmq.IDENTITY, f"{uuid.uuid4().hex}-{name[:32]}".encode())
        s.setsockopt(zmq.LINGER, 0)
        s.setsockopt(zmq.MAXMSGSIZE, LARGEST_FRAME)
        s.setsockopt(zmq.SNDHWM, QUEUE)
        s.setsockopt(zmq.RCVHWM, QUEUE)
        s.setsockopt(zmq.HEARTBEAT_IVL, 1000)
        s.setsockopt(zmq.HEARTBEAT_TIMEOUT, 10_000)
        try:
            # Not ZMQ_IMMEDIATE, which would tell a missing server sooner: with it a reply that came
            # just before a disconnection is dropped unread.
            self._monitor = s.get_monitor_socket(
                zmq.EVENT_HANDSHAKE_SUCCEEDED | zmq.EVENT_DISCONNECTED
            )
            s.connect(self.address)
        except zmq.ZMQError as error:
            raise BridgeError(f"{self.address}: is no address ({error.strerror})") from None
        return s

    def _hello(self, name: str) -> Welcome:
        message = Hello(client=name, versions=(VERSION,))
        reply, _ = self._ask(message, Welcome, None)
        return reply

    def ping(self) -> float:
        """Round-trip time [s]."""
        id = self._next_id()
        start = time.perf_counter()
        self._ask(Ping(id=id), Pong, id)
        return time.perf_counter() - start

    def render(
        self,
        tai_ns: int,
        camera: str,
        bodies: Mapping[str, BodyPose] | None = None,
        exposure_time_s: float | None = None,
        products: Sequence[str] = ("dn",),
        *,
        retry: bool = False,
    ) -> Image:
        """The picture that a camera takes of a state.

        tai_ns : mid-exposure, a whole number (a float would lose nanoseconds)
        bodies : spacecraft left out follow the scenario's own laws
        exposure_time_s : None takes the camera's own
        products : of "dn", "radiance", "electrons", "depth", "part_id"
        retry : ask once more, with another ``timeout_s``, where no answer comes; the server renders
            once
        """
        request = Render(
            id=self._next_id(),
            tai_ns=operator.index(tai_ns),
            camera=camera,
            bodies={name: pose.as_sent() for name, pose in (bodies or {}).items()},
            exposure_time_s=None if exposure_time_s is None else float(exposure_time_s),
            products=tuple(products),
        )
        attempts = 2 if retry else 1
        images, payload = self._ask(request, Images, request.id, attempts)
        self._verify(request, images)
        planes = self._planes(images.planes, payload)
        self._last_sequence = images.sequence
        return Image(
            planes=planes,
            sequence=images.sequence,
            tai_ns=images.tai_ns,
            state_hash=images.state_hash,
            camera=images.camera,
            camera_position_m=images.camera_position_m,
            q_camera_from_icrf_xyzw=images.q_camera_from_icrf_xyzw,
            exposure_time_s=images.exposure_time_s,
            intrinsics=np.array(images.intrinsics),
            seed=images.seed,
            saturated_pixels=images.saturated_pixels,
            render_time_s=images.render_us * 1e-6,
            part_names=images.part_names,
        )

    def _next_id(self) -> int:
        self._last_id += 1
        return self._last_id

    def _ask(
        self, message: Message, kind: type[_R], id: int | None, attempts: int = 1
    ) -> tuple[_R, Sequence[memoryview]]:
        """The reply of a kind to a message, with its payload frames."""
        frames = pack(message)
        for _ in range(attempts):
            deadline = time.monotonic() + self.timeout_s
            if self._wait(zmq.POLLOUT, deadline):
                self._socket.send_multipart(frames, zmq.NOBLOCK)
            while self._wait(zmq.POLLIN, deadline):
                parts = [f.buffer for f in self._socket.recv_multipart(copy=False)]
                reply = self._reply(parts)
                # An error without id belongs to the only request that is open.
                if isinstance(reply, Error) and reply.id in (id, None):
                    raise RemoteError(self.address, reply)
                if isinstance(reply, kind) and getattr(reply, "id", None) == id:
                    return reply, parts[2:]
        raise self._timed_out(message, attempts)

    def _reply(self, parts: Sequence[memoryview]) -> Message:
        try:
            return unpack_reply(parts)
        except BadMessageError as error:
            raise BridgeError(f"{self.address}: the server sent nonsense: {error}") from None

    def _wait(self, event: int, deadline: float) -> bool:
        left = deadline - time.monotonic()
        return left > 0.0 and bool(self._socket.poll(math.ceil(left * 1000.0), event))

    def _is_connected(self) -> bool:
        while self._monitor.poll(0):
            event = recv_monitor_message(self._monitor)["event"]
            self._connection = event == zmq.EVENT_HANDSHAKE_SUCCEEDED
        return self._connection

    def _timed_out(self, message: Message, attempts: int) -> BridgeError:
        problem = "no answer" if self._is_connected() else "no connection"
        asked = type(message).__name__.lower()
        last = self._last_sequence
        seen = "no image received before" if last is None else f"last image was sequence {last}"
        return BridgeError(
            f"{self.address}: {problem} within {attempts * self.timeout_s:g} s for {asked}; {seen}"
        )

    def _verify(self, request: Render, images: Images) -> None:
        """Raises BridgeError unless the reply shows the state asked for."""
        if images.boot != self.welcome.boot:
            raise BridgeError(f"{self.address}: the server was restarted; connect again")
        given = request.exposure_time_s
        own = state_hash(
            tai_ns=request.tai_ns,
            bodies=request.bodies,
            camera=request.camera,
            exposure_time_s=self._camera_exposure(request.camera) if given is None else given,
            seed=self.welcome.seed,
        )
        if (images.tai_ns, images.state_hash) != (request.tai_ns, own):
            raise BridgeError(
                f"{self.address}: image {images.sequence} shows another state than request "
                f"{request.id}: {images.tai_ns} ns, hash {images.state_hash}; "
                f"asked for {request.tai_ns} ns, hash {own}"
            )

    def _camera_exposure(self, camera: str) -> float:
        return next(c.exposure_time_s for c in self.welcome.cameras if c.name == camera)

    def _planes(
        self, planes: Sequence[Plane], payload: Sequence[memoryview]
    ) -> dict[str, NDArray[Any]]:
        """Arrays over the received frames, without a copy."""
        if len(planes) != len(payload):
            raise BridgeError(
                f"{self.address}: reply announces {len(planes)} planes and brings {len(payload)}"
            )
        return {p.product: self._pixels(p, frame) for p, frame in zip(planes, payload, strict=True)}

    def _pixels(self, plane: Plane, frame: memoryview) -> NDArray[Any]:
        if plane.dtype not in DTYPES or min(plane.shape, default=0) < 1:
            raise BridgeError(f"{self.address}: is no plane: {plane}")
        dtype = np.dtype(plane.dtype)
        expected = math.prod(plane.shape) * dtype.itemsize
        if frame.nbytes != expected:
            raise BridgeError(
                f'{self.address}: plane "{plane.product}" announces {expected} bytes '
                f"and brings {frame.nbytes}"
            )
        array = np.frombuffer(frame, dtype=dtype).reshape(plane.shape)
        array.flags.writeable = False
        return array

    def close(self) -> None:
        """Say goodbye and hang up, without waiting."""
        if self._context.closed:
            return
        if self._is_connected() and self._socket.poll(0, zmq.POLLOUT):
            self._socket.send_multipart(pack(Bye()), zmq.NOBLOCK)
        # Time for the goodbye to leave; a server that is gone costs no more than this.
        self._context.destroy(linger=100)

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
