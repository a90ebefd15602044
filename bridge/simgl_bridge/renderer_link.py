"""The renderer as its server sees it: another process, which does one task at a time.

The server must answer at any moment, and a renderer holds Python's lock for minutes: while light is
traced, a shader is compiled, or pixels are read back. So each has its own process. Messages and
images cross a pair of sockets and memory that both share.
"""

from __future__ import annotations

import signal
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Protocol

import msgspec

from simgl.errors import BridgeError
from simgl_bridge.message_parts import ServerStatus
from simgl_bridge.messages import Configure, Error, ErrorCode, Message
from simgl_bridge.renderer_messages import (
    ENCODER,
    REPORT_DECODER,
    Answer,
    Failure,
    Finish,
    Progress,
    ServedScene,
    Task,
)
from simgl_bridge.server import print_line
from simgl_bridge.shared_frames import Connection, socket_pair

# A renderer that does not return an image for this long is started again [s]; a request with a
# longer deadline has that time.
LONGEST_DRAW = 600.0
# A renderer that dies this many times in a row while it starts is given up.
MAX_EARLY_DEATHS = 5
# A renderer that was asked to end is killed after this [s].
_PATIENCE = 5.0

Payload = list[memoryview]


class RendererHandle(Protocol):
    """A renderer that was started; a ``subprocess.Popen`` is one."""

    def poll(self) -> int | None:
        """Its exit code; None while it runs."""

    def kill(self) -> None:
        """End it at once."""

    def wait(self, timeout: float | None = None) -> int:
        """Wait for its end; raises ``subprocess.TimeoutExpired``."""


# Starts a renderer at its end of a connection, with a scenario of the server's folder (None takes
# the first one) and a seed (None takes the scenario's own).
StartRenderer = Callable[[socket.socket, str | None, int | None], RendererHandle]


class RendererLink:
    """Starts a renderer, gives it tasks, and knows its state.

    start_renderer : how
    scene : what the renderer last said that it serves; None before the first time
    """

    _connection: Connection

    def __init__(self, start_renderer: StartRenderer) -> None:
        self._start_renderer = start_renderer
        self._process: RendererHandle | None = None
        self._deaths = 0
        self._task: Task | None = None
        self._chosen: str | None = None
        self.scene: ServedScene | None = None
        self._set_state("starting", "the renderer's process")

    def start(self) -> None:
        """Start the renderer, which then says when it is ready."""
        ours, theirs = socket_pair()
        self._connection = Connection(ours)
        seed = None if self.scene is None else self.scene.seed
        with theirs:
            self._process = self._start_renderer(theirs, self._chosen, seed)

    @property
    def connections(self) -> list[Connection]:
        """Where answers arrive; none while the renderer ends."""
        return [] if self._connection.is_cut else [self._connection]

    def _set_state(self, state: str, detail: str = "") -> None:
        self._state = ServerStatus(state=state, detail=detail)
        self._state_since = time.monotonic()

    @property
    def status(self) -> ServerStatus:
        """What it is doing now."""
        since = round(time.monotonic() - self._state_since, 3)
        return msgspec.structs.replace(self._state, since_s=since)

    @property
    def is_free(self) -> bool:
        """Whether it can take a task."""
        return self._state.state == "ready"

    def begin(self, task: Task) -> None:
        """Give it a task; ``answers`` brings the answer."""
        self._task = task
        if isinstance(task, Configure):
            self._set_state("starting", "another scenario")
        else:
            self._set_state("drawing")
        self._send(task)

    def _send(self, task: Task | Finish) -> None:
        # One that has just died takes nothing, which is noticed soon.
        with suppress(OSError):
            self._connection.send([ENCODER.encode(task)])

    def answers(self) -> Iterator[tuple[Answer, Payload]]:
        """What has come back; a renderer that died answers its task with an Error.

        Raises BridgeError where it cannot start.
        """
        assert self._process is not None
        # Before what it sent last is received.
        code = self._process.poll()
        while (received := self._receive()) is not None:
            report, payload = received
            if isinstance(report, Failure):
                raise BridgeError(report.detail)
            if isinstance(report, Progress):
                self._report(report)
                continue
            if isinstance(report, ServedScene):
                self._take_scene(report)
            if self._task is not None:
                self._task = None
                self._set_state("ready")
                assert isinstance(report, Answer)
                yield report, payload
        if code is not None:
            yield from self._lost(_ending(code), is_killed=code < 0)

    def _receive(self) -> tuple[Message, Payload] | None:
        """The next report with its frames; None where nothing waits."""
        try:
            frames = self._connection.receive()
        except BridgeError as error:
            problem = f"{error}: the server's process"
            return Error(id=None, code=ErrorCode.INTERNAL, field="", detail=problem), []
        return (REPORT_DECODER.decode(frames[0]), frames[1:]) if frames else None

    def _report(self, report: Progress) -> None:
        self._state = msgspec.structs.replace(
            self._state, detail=report.what, done=report.done, total=report.total
        )

    def _take_scene(self, scene: ServedScene) -> None:
        self.scene, self._deaths = scene, 0
        if isinstance(self._task, Configure):
            self._chosen = self._task.scenario or self._chosen
        else:
            self._set_state("ready")

    def give_up_task(self) -> Iterator[tuple[Answer, Payload]]:
        """Kill a renderer that does not return."""
        assert self._process is not None
        self._process.kill()
        self._process.wait()
        return self._lost(f"did not return within {LONGEST_DRAW:g} s")

    def _lost(self, reason: str, is_killed: bool = True) -> Iterator[tuple[Answer, Payload]]:
        if self._task is None and self._state.state != "ready":
            self._deaths += 1
            # What ends by itself before it is ready ends so every time.
            if not is_killed:
                raise BridgeError(f"the renderer {reason}")
            if self._deaths == MAX_EARLY_DEATHS:
                raise BridgeError(f"the renderer {reason}, {self._deaths} times in a row")
        print_line(f"simgl: the renderer {reason} and is started again")
        task, self._task = self._task, None
        self._set_state("lost", f"the renderer {reason}")
        self._connection.close()
        if task is not None:
            problem = f"the renderer {reason} and is started again"
            code = ErrorCode.RENDERER_LOST
            yield Error(id=None, code=code, field="", detail=problem, retryable=True), []
        self.start()

    def close(self) -> None:
        """End the renderer: at once, or in order where it waits for a task."""
        if self._process is None:
            return
        if self.is_free:
            self._send(Finish())
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(_PATIENCE)
        self._process.kill()
        self._process.wait()
        self._connection.close()


def _ending(code: int) -> str:
    if code >= 0:
        return f"ended with code {code}"
    return f"died of {signal.Signals(-code).name}"
