"""A small scenario and a server of it on a thread of this process."""

from __future__ import annotations

import socket
import subprocess
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from contextlib import ExitStack, closing, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import msgspec
import zmq
from simgl_bridge.basilisk.camera_overrides import CameraOverrides
from simgl_bridge.basilisk.endpoint import BasiliskEndpoint
from simgl_bridge.basilisk.viz_scene import check_base
from simgl_bridge.body_pose import BodyPose
from simgl_bridge.render_process import Renderer, ServerLink, render_tasks
from simgl_bridge.render_queue import RenderQueue
from simgl_bridge.render_session import RenderSession
from simgl_bridge.renderer_link import RendererLink
from simgl_bridge.server import Endpoint, serve
from simgl_bridge.session_recording import SessionRecorder
from simgl_bridge.simgl1_endpoint import Simgl1Endpoint

from benchmarks.bridge.scene import SMALL
from simgl import Capture, Product, Scenario, Simulator
from simgl.scene.state import SceneState
from simgl.thermal.scene_temperatures import Temperatures
from tests.patience import limit

# The scene of the long runs with a second camera.
_SIDE = """\
[camera.side]
position_icrf_m = [50.0, 0.0, 10.0]
look_at = "target"
width_px = 48
height_px = 40
focal_length_mm = 2.0
"""
SCENARIO = SMALL.replace("[render]", f"{_SIDE}[render]")
_LAMP = """
[lamp.flood]
on = "chaser"
position_body_m = [0.05, 0.0, -0.2]
boresight = [0.0, 0.0, -1.0]
half_angle_deg = 20.0
power_w = 5000.0
temperature_k = 3000.0
"""
# The same with a lamp.
LIT_SCENARIO = SCENARIO.replace("[render]", f"{_LAMP}[render]")
# Of the chaser, before the target.
TURNING = BodyPose(
    position_m=(0.5, -0.25, 40.0),
    velocity_m_s=(0.0, 0.0, -0.1),
    q_icrf_from_body_xyzw=(0.0, 0.0, 0.0, 1.0),
    angular_velocity_rad_s=(0.25, -0.5, 0.125),
)


class WatchedSimulator(Simulator):
    """A simulator that counts its captures, and runs a hook before each one."""

    captured = 0
    hook: Callable[[], None] | None = None

    def capture(
        self,
        state: SceneState,
        camera: str,
        products: Any = frozenset({Product.DN}),
        during: Callable[[int], SceneState] | None = None,
        seed: int | None = None,
        draw: int = 0,
        temperatures: Temperatures | None = None,
    ) -> Capture:
        self.captured += 1
        if self.hook is not None:
            self.hook()
        return super().capture(state, camera, products, during, seed, draw, temperatures)


class Gate:
    """A hook that holds the picture in hand until it is let go."""

    def __init__(self) -> None:
        self._reached = threading.Event()
        self._open = threading.Event()

    def __call__(self) -> None:
        self._reached.set()
        assert self._open.wait(limit(20.0)), "nobody opened the gate"

    def wait(self) -> None:
        """Until a picture is in hand."""
        assert self._reached.wait(limit(20.0)), "no picture was begun"

    def open(self, settle: float = 0.3) -> None:
        """Let it go, once what was sent meanwhile lies at the server's socket."""
        time.sleep(limit(settle))
        self._open.set()


class RendererThread:
    """A renderer on a thread of this process: what a test may look into."""

    def __init__(
        self,
        connection: socket.socket,
        scenario: Scenario,
        made: list[WatchedSimulator],
        root: Path | None,
        overrides: Mapping[int, CameraOverrides],
        recorder: SessionRecorder | None,
    ) -> None:
        def open_simulator(scenario: Scenario) -> WatchedSimulator:
            made.append(WatchedSimulator(scenario))
            return made[-1]

        def open_renderer(link: ServerLink) -> Renderer:
            del link
            session = RenderSession(scenario, root=root, open_simulator=open_simulator)
            renderer = Renderer(session, overrides, recorder)
            if recorder is not None:
                recorder.opened(renderer.scene, scenario_file=scenario.source, root=root)
            return renderer

        # The server closes its copy.
        self._connection = connection.dup()
        self._thread = threading.Thread(target=render_tasks, args=(self._connection, open_renderer))
        self._thread.start()

    def poll(self) -> int | None:
        """A thread has no exit code; None while it runs."""
        return None if self._thread.is_alive() else 0

    def kill(self) -> None:
        """A thread cannot be killed: it ends after its task."""
        with suppress(OSError):
            self._connection.shutdown(socket.SHUT_RDWR)

    def wait(self, timeout: float | None = None) -> int:
        """Wait for its end."""
        self._thread.join(limit(20.0) if timeout is None else timeout)
        if self._thread.is_alive():
            raise subprocess.TimeoutExpired("renderer", timeout or 0.0)
        return 0


@dataclass
class Running:
    """A server on a thread: what a test needs of it."""

    front: Simgl1Endpoint
    simulators: list[WatchedSimulator]
    stop: threading.Event
    thread: threading.Thread

    @property
    def address(self) -> str:
        """Where it listens."""
        return self.front.address

    @property
    def simulator(self) -> WatchedSimulator:
        """The one in use."""
        return self.simulators[-1]


def start(
    scenario: Scenario,
    address: str = "tcp://127.0.0.1:*",
    root: Path | None = None,
    recorder: SessionRecorder | None = None,
    **options: Any,
) -> Running:
    """Start server and renderer on new threads, and wait until it is ready.

    options : of the endpoint
    """

    def open_endpoint(queue: RenderQueue) -> Simgl1Endpoint:
        return Simgl1Endpoint(queue, address, root=root, **options)

    return Running(*_started(scenario, open_endpoint, root, {}, recorder))


def _started(
    scenario: Scenario,
    open_endpoint: Callable[[RenderQueue], Any],
    root: Path | None,
    overrides: Mapping[int, CameraOverrides],
    recorder: SessionRecorder | None = None,
) -> tuple[Any, list[WatchedSimulator], threading.Event, threading.Thread]:
    made: list[WatchedSimulator] = []
    stop = threading.Event()
    ready: Future[Endpoint] = Future()

    def start_renderer(
        connection: socket.socket, chosen: str | None, seed: int | None
    ) -> RendererThread:
        del chosen, seed
        return RendererThread(connection, scenario, made, root, overrides, recorder)

    def run() -> None:
        try:
            with ExitStack() as stack:
                link = stack.enter_context(closing(RendererLink(start_renderer)))
                queue = RenderQueue(link)
                endpoint = stack.enter_context(open_endpoint(queue))
                serve([endpoint], queue, stop, on_ready=lambda: ready.set_result(endpoint))
        except BaseException as error:
            if ready.done():
                raise
            ready.set_exception(error)

    thread = threading.Thread(target=run)
    thread.start()
    return ready.result(timeout=limit(60.0)), made, stop, thread


def finish(running: Running) -> None:
    """Stop a server and wait for its thread."""
    running.stop.set()
    running.thread.join(timeout=limit(20.0))
    assert not running.thread.is_alive()


@contextmanager
def basilisk_source(
    base: Scenario,
    overrides: Mapping[int, CameraOverrides] | None = None,
    address: str = "tcp://127.0.0.1:*",
) -> Iterator[tuple[BasiliskEndpoint, WatchedSimulator]]:
    """An image source for Basilisk on threads of this process, and its first simulator."""
    check_base(base)
    endpoint, made, stop, thread = _started(
        base, lambda queue: BasiliskEndpoint(queue, address), None, dict(overrides or {})
    )
    try:
        yield endpoint, made[0]
    finally:
        stop.set()
        thread.join(timeout=limit(20.0))
    assert not thread.is_alive()


def server_script(patch: str) -> str:
    """A server as a program, whose renderer process has run a patch of its module ``r``."""
    renderer = f"import time\nimport simgl_bridge.render_process as r\n{patch}\nr.main()\n"
    return (
        "import sys\n"
        "import simgl_bridge.processes as processes\n"
        "from simgl_bridge.commands import main\n"
        f"processes.RENDERER_COMMAND = (sys.executable, '-c', {renderer!r})\n"
        "main()\n"
    )


def free_address() -> str:
    """An address of this machine where nobody listens."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp://127.0.0.1:{probe.getsockname()[1]}"


class RawLink:
    """A DEALER socket that sends any frames at all, and never waits beyond five seconds.

    made : every one since the test began; a test that fails leaves none open (see conftest)
    """

    made: ClassVar[list[RawLink]] = []

    def __init__(self, address: str, identity: bytes = b"") -> None:
        self.made.append(self)
        self._context = zmq.Context()
        self._socket = self._context.socket(zmq.DEALER)
        self._socket.linger = 0
        if identity:
            self._socket.setsockopt(zmq.IDENTITY, identity)
        self._socket.connect(address)

    def send(self, frames: Sequence[bytes]) -> None:
        """Send frames as they are."""
        self._socket.send_multipart(frames)

    def send_or_drop(self, frames: Sequence[bytes]) -> None:
        """Send frames unless the queue is full."""
        if self._socket.poll(0, zmq.POLLOUT):
            self._socket.send_multipart(frames, zmq.NOBLOCK)

    def has_reply(self) -> bool:
        """Whether a reply is there within a fifth of a second."""
        return bool(self._socket.poll(round(limit(200))))

    def receive(self) -> list[bytes]:
        """The next reply's frames."""
        assert self._socket.poll(round(limit(5000))), "no reply"
        return self._socket.recv_multipart()

    def ask(self, frames: Sequence[bytes]) -> dict[str, Any]:
        """Header of the reply to frames."""
        self.send(frames)
        return header_of(self.receive())

    def ask_map(self, request: object) -> dict[str, Any]:
        """Header of the reply to a header given as a plain object."""
        return self.ask([b"simgl/1", msgspec.msgpack.encode(request)])

    def close(self) -> None:
        """Hang up."""
        self._context.destroy(linger=0)


def header_of(frames: Sequence[bytes]) -> dict[str, Any]:
    """The decoded header of a reply."""
    assert frames[0] == b"simgl/1"
    header = msgspec.msgpack.decode(frames[1])
    assert isinstance(header, dict)
    return header


# What a later version may add anywhere.
NEWER = {"of_a_newer_version": {"deep": [1, None, "text", 2.5, {"more": True}]}}


def newer(value: Any) -> Any:
    """A header as a newer server would send it: more fields in every map that is a message."""
    if isinstance(value, list):
        return [newer(v) for v in value]
    if not isinstance(value, dict):
        return value
    # Maps by name hold what they hold.
    named = ("bodies", "part_names", "joints")
    more = {k: v if k in named else newer(v) for k, v in value.items()} | NEWER
    return more | (
        {"code": "FROM_LATER", "retryable": True} if value.get("type") == "error" else {}
    )


class Proxy:
    """Carries the messages of one client to a server and back, on a thread, until ``close``.

    change : of a reply's header
    answer : to a request's header, instead of the server's reply; None lets the server answer
    """

    def __init__(
        self,
        server: str,
        change: Callable[[Any], Any] = lambda header: header,
        answer: Callable[[Any], Any] = lambda _: None,
    ) -> None:
        self._change, self._answer = change, answer
        self._stop = threading.Event()
        self._context: zmq.Context[Any] = zmq.Context()
        self._front = self._context.socket(zmq.ROUTER)
        self._back = self._context.socket(zmq.DEALER)
        self._front.bind("tcp://127.0.0.1:*")
        self._back.connect(server)
        self.address = self._front.get_string(zmq.LAST_ENDPOINT)
        self._thread = threading.Thread(target=self._carry)
        self._thread.start()

    def _carry(self) -> None:
        client = b""
        while not self._stop.is_set():
            if self._front.poll(10):
                client, version, header, *rest = self._front.recv_multipart()
                answer = self._answer(msgspec.msgpack.decode(header))
                if answer is None:
                    self._back.send_multipart([version, header, *rest])
                else:
                    self._front.send_multipart([client, version, msgspec.msgpack.encode(answer)])
            while self._back.poll(0):
                version, header, *planes = self._back.recv_multipart()
                changed = msgspec.msgpack.encode(self._change(msgspec.msgpack.decode(header)))
                self._front.send_multipart([client, version, changed, *planes])
        # The server may serve others at once.
        self._back.send_multipart([b"simgl/1", msgspec.msgpack.encode({"type": "bye"})])
        self._front.close(linger=0)
        self._context.destroy(linger=100)

    def close(self) -> None:
        """End without a goodbye to the client, as a server that is killed does."""
        self._stop.set()
        self._thread.join(limit(10.0))
