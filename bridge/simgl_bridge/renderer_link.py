"""The renderer as its server sees it: another process, which does one task at a time.

The server must answer at any moment, and a renderer holds Python's lock for minutes: while light is
traced, a shader is compiled, or pixels are read back. So each has its own process. Messages and
images cross a local socket in a folder that only this user can enter.
"""

from __future__ import annotations

import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any, Protocol

import msgspec
import zmq

from simgl.errors import BridgeError
from simgl_bridge.message_parts import ServerStatus
from simgl_bridge.messages import Configure, Error, ErrorCode
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
from simgl_bridge.sockets import receive, send

# A renderer that does not return an image for this long is started again [s]; a request with a
# longer deadline has that time.
LONGEST_DRAW = 600.0
# A renderer that dies this many times in a row while it starts is given up.
MAX_EARLY_DEATHS = 5
# What a renderer sent before it died is here once nothing has come for this long [s].
_LAST_WORDS = 0.3
# A renderer that was asked to end is killed after this [s].
_PATIENCE = 5.0

Payload = list[zmq.Frame]


class RendererHandle(Protocol):
    """A renderer that was started; a ``subprocess.Popen`` is one."""

    def poll(self) -> int | None:
        """Its exit code; None while it runs."""

    def kill(self) -> None:
        """End it at once."""

    def wait(self, timeout: float | None = None) -> int:
        """Wait for its end; raises ``subprocess.TimeoutExpired``."""


# Starts a renderer that connects to an address, with a scenario of the server's folder (None takes
# the first one) and a seed (None takes the scenario's own).
StartRenderer = Callable[[str, str | None, int | None], RendererHandle]


class RendererLink:
    """Starts a renderer, gives it tasks, and knows its state.

    start_renderer : how
    scene : what the renderer last said that it serves; None before the first time
    """

    socket: zmq.Socket[Any]

    def __init__(self, start_renderer: StartRenderer) -> None:
        self._start_renderer = start_renderer
        self._process: RendererHandle | None = None
        self._context: zmq.Context[Any] = zmq.Context()
        self._deaths = 0
        self._task: Task | None = None
        self._chosen: str | None = None
        self._died_at: float | None = None
        self.scene: ServedScene | None = None
        self._set_state("starting", "the renderer's process")

    def start(self) -> None:
        """Start the renderer, which then says when it is ready."""
        self._folder = tempfile.mkdtemp(prefix="simgl-")
        self.socket = self._context.socket(zmq.PAIR)
        self.socket.setsockopt(zmq.LINGER, 0)
        address = f"ipc://{self._folder}/renderer"
        try:
            self.socket.bind(address)
            seed = None if self.scene is None else self.scene.seed
            self._process = self._start_renderer(address, self._chosen, seed)
        except zmq.ZMQError as error:
            self._remove_folder()
            raise BridgeError(f"{address}: cannot be bound ({error.strerror})") from None
        except BaseException:
            self._remove_folder()
            raise

    def _remove_folder(self) -> None:
        shutil.rmtree(self._folder, ignore_errors=True)

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
        # One that has just died takes nothing, which is noticed soon.
        with suppress(zmq.Again):
            send(self.socket, [ENCODER.encode(task)])

    def answers(self) -> Iterator[tuple[Answer, Payload]]:
        """What has come back; a renderer that died answers its task with an Error.

        Raises BridgeError where it cannot start.
        """
        while frames := receive(self.socket):
            self._died_at = None
            report = REPORT_DECODER.decode(frames[0].buffer)
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
                yield report, frames[1:]
        yield from self._deaths_noticed()

    def _report(self, report: Progress) -> None:
        # It is connected: nothing stays behind if this process is killed.
        self._remove_folder()
        self._state = msgspec.structs.replace(
            self._state, detail=report.what, done=report.done, total=report.total
        )

    def _take_scene(self, scene: ServedScene) -> None:
        self.scene, self._deaths = scene, 0
        if isinstance(self._task, Configure):
            self._chosen = self._task.scenario or self._chosen
        else:
            self._set_state("ready")

    def _deaths_noticed(self) -> Iterator[tuple[Answer, Payload]]:
        assert self._process is not None
        code = self._process.poll()
        if code is None:
            return
        now = time.monotonic()
        if self._died_at is None:
            self._died_at = now
        if now - self._died_at < _LAST_WORDS:
            return
        yield from self._lost(_ending(code), is_killed=code < 0)

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
        task, self._task, self._died_at = self._task, None, None
        self._set_state("lost", f"the renderer {reason}")
        self._disconnect()
        if task is not None:
            problem = f"the renderer {reason} and is started again"
            code = ErrorCode.RENDERER_LOST
            yield Error(id=None, code=code, field="", detail=problem, retryable=True), []
        self.start()

    def _disconnect(self) -> None:
        self.socket.close(linger=0)
        self._remove_folder()

    def close(self) -> None:
        """End the renderer: at once, or in order where it waits for a task."""
        if self._process is not None:
            if self.is_free:
                with suppress(zmq.Again, subprocess.TimeoutExpired):
                    send(self.socket, [ENCODER.encode(Finish())])
                    self._process.wait(_PATIENCE)
            self._process.kill()
            self._process.wait()
            self._disconnect()
        self._context.destroy(linger=0)


def _ending(code: int) -> str:
    if code >= 0:
        return f"ended with code {code}"
    return f"died of {signal.Signals(-code).name}"
