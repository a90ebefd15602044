"""The server: one ROUTER socket, one OpenGL context, one thread, one picture at a time."""

from __future__ import annotations

import errno
import time
import traceback
import uuid
from typing import Protocol

import zmq

from simgl import __version__
from simgl.errors import BridgeError
from simgl.scene.camera import Camera
from simgl.simulator import Simulator
from simgl_bridge.address import check_bindable, ipc_path
from simgl_bridge.messages import (
    Bye,
    CameraCard,
    Error,
    ErrorCode,
    Hello,
    Images,
    Message,
    Ping,
    Pong,
    Render,
    Vector,
    Welcome,
    state_hash,
)
from simgl_bridge.picture import Picture, take_picture
from simgl_bridge.replies import Frames, ReplyCache
from simgl_bridge.wire import VERSION, BadMessageError, pack, unpack_request

# How soon a stop is noticed while no request comes [ms].
POLL_MS = 50
# Replies that may still be on their way when the server stops get this long [ms].
LINGER_MS = 2000
# ZeroMQ drops a client that sends a longer frame; headers have their own, smaller limit.
LARGEST_FRAME = 1024 * 1024
# Messages waiting for one client. Lock-step needs one; a reader that stalls loses what is beyond.
QUEUE = 16


class Stop(Protocol):
    """What ends the service; a ``threading.Event`` is one."""

    def is_set(self) -> bool:
        """Whether to stop now."""


class Server:
    """Answers requests with pictures of a simulator's scenario.

    Use it on the thread that opened the simulator: OpenGL stays there. Raises ConfigError for an
    address beyond this machine and BridgeError where it cannot be bound.

    >>> with Simulator(scenario) as simulator, Server(simulator, "tcp://127.0.0.1:5563") as server:
    ...     server.serve(stop)
    """

    def __init__(self, simulator: Simulator, address: str) -> None:
        check_bindable(address)
        self._simulator = simulator
        self._boot = uuid.uuid4().hex
        self._sequence = 0
        self._replies = ReplyCache()
        self._context = zmq.Context()
        self._socket = self._context.socket(zmq.ROUTER)
        self._configure()
        try:
            self._socket.bind(address)
        except zmq.ZMQError as error:
            self._context.destroy(linger=0)
            raise BridgeError(f"{address}: cannot be bound ({error.strerror})") from None
        if path := ipc_path(address):
            path.chmod(0o600)
        self.address = self._socket.get_string(zmq.LAST_ENDPOINT)

    def _configure(self) -> None:
        s = self._socket
        s.setsockopt(zmq.LINGER, 0)
        s.setsockopt(zmq.MAXMSGSIZE, LARGEST_FRAME)
        s.setsockopt(zmq.SNDHWM, QUEUE)
        s.setsockopt(zmq.RCVHWM, QUEUE)
        # A client that comes back with its identity takes over at once.
        s.setsockopt(zmq.ROUTER_HANDOVER, 1)
        # A reply to a client that left is an error that can be seen, not silence.
        s.setsockopt(zmq.ROUTER_MANDATORY, 1)
        s.setsockopt(zmq.HEARTBEAT_IVL, 1000)
        s.setsockopt(zmq.HEARTBEAT_TIMEOUT, 10_000)

    @property
    def summary(self) -> str:
        """One line: where, with what, and what there is to see."""
        scenario = self._simulator.scenario
        sizes = [
            f"{name} {c.detector.width}x{c.detector.height}" for name, c in scenario.cameras.items()
        ]
        return (
            f'simgl serves "{scenario.name}" at {self.address} ({VERSION}) '
            f"on {self._simulator.renderer_name}; "
            f"cameras: {', '.join(sizes) or 'none'}; bodies: {', '.join(scenario.models) or 'none'}"
        )

    def serve(self, stop: Stop) -> None:
        """Answer until ``stop`` is set; a request in hand is finished and its reply sent first."""
        poller = zmq.Poller()
        poller.register(self._socket, zmq.POLLIN)
        while not stop.is_set():
            if poller.poll(POLL_MS):
                client, *frames = self._socket.recv_multipart()
                self._send(client, self._answer(client, frames))

    def _send(self, client: bytes, frames: Frames) -> None:
        if not frames:
            return
        try:
            self._socket.send_multipart([client, *frames], zmq.NOBLOCK, copy=False)
        except zmq.ZMQError as error:
            # A client that left, or reads nothing, loses its reply; it may ask again.
            if error.errno not in (errno.EHOSTUNREACH, zmq.EAGAIN):
                raise

    def _answer(self, client: bytes, frames: list[bytes]) -> Frames:
        """The reply to one message, whatever it holds; empty where none is due."""
        id = None
        try:
            request = unpack_request(frames)
            id = getattr(request, "id", None)
            return self._reply(client, request, frames[1])
        except BadMessageError as error:
            reply = Error(id=error.id, code=error.code, field=error.field, detail=str(error))
            return pack(reply)
        # Nothing that a request sets off may end the service for the others.
        except Exception as error:
            traceback.print_exc()
            detail = " ".join(f"{type(error).__name__}: {error}".split())
            return pack(Error(id=id, code=ErrorCode.INTERNAL, field="", detail=detail))

    def _reply(self, client: bytes, request: Message, header: bytes) -> Frames:
        if isinstance(request, Render):
            if kept := self._replies.find(client, request.id, header):
                return kept
            frames = self._images(request)
            self._replies.keep(client, request.id, header, frames)
            return frames
        if isinstance(request, Ping):
            return pack(Pong(id=request.id, boot=self._boot))
        self._replies.forget(client)
        if isinstance(request, Bye):
            return []
        assert isinstance(request, Hello)
        if VERSION not in request.versions:
            problem = f'must hold "{VERSION}", got {list(request.versions)}'
            raise BadMessageError(ErrorCode.VERSION, "versions", problem)
        return pack(self._welcome())

    def _welcome(self) -> Welcome:
        scenario = self._simulator.scenario
        return Welcome(
            server=__version__,
            boot=self._boot,
            renderer=self._simulator.renderer_name,
            scenario=scenario.name,
            epoch_tai_ns=scenario.epoch_tai_ns,
            seed=scenario.seed,
            cameras=tuple(_card(name, camera) for name, camera in scenario.cameras.items()),
            bodies=tuple(scenario.models),
        )

    def _images(self, request: Render) -> Frames:
        start = time.perf_counter()
        picture = take_picture(self._simulator, request)
        seconds = time.perf_counter() - start
        self._sequence += 1
        header = pack(self._description(request, picture, seconds))
        return [*header, *(p.data.cast("B") for p in picture.pixels)]

    def _description(self, request: Render, picture: Picture, seconds: float) -> Images:
        info, truth = picture.exposure.info, picture.exposure.truth
        return Images(
            id=request.id,
            sequence=self._sequence,
            boot=self._boot,
            tai_ns=info.epoch_tai_ns,
            state_hash=state_hash(
                tai_ns=info.epoch_tai_ns,
                bodies=request.bodies,
                camera=info.camera.name,
                exposure_time_s=picture.exposure_time,
                seed=info.seed,
            ),
            camera=info.camera.name,
            camera_position_m=picture.camera_position,
            q_camera_from_icrf_xyzw=picture.q_camera_from_icrf_xyzw,
            exposure_time_s=picture.exposure_time,
            intrinsics=_rows(info.camera),
            seed=info.seed,
            saturated_pixels=picture.saturated_pixels,
            render_us=round(seconds * 1e6),
            planes=picture.planes,
            part_names=truth.part_names if truth and "part_id" in request.products else {},
        )

    def close(self) -> None:
        """Give the address back once the last replies are out, at most two seconds later."""
        self._context.destroy(linger=LINGER_MS)

    def __enter__(self) -> Server:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _rows(camera: Camera) -> tuple[Vector, Vector, Vector]:
    a, b, c = camera.intrinsics.tolist()
    return tuple(a), tuple(b), tuple(c)


def _card(name: str, camera: Camera) -> CameraCard:
    d, K = camera.detector, camera.intrinsics
    return CameraCard(
        name=name,
        width=d.width,
        height=d.height,
        bits=d.bits,
        pedestal_dn=d.pedestal,
        full_well_e=d.full_well,
        gain_dn_per_e=d.gain_dn_per_e,
        focal_length_px=camera.focal_length_px,
        cx=float(K[0, 2]),
        cy=float(K[1, 2]),
        exposure_time_s=camera.exposure_time,
    )
