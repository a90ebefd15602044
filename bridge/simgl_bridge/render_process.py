"""The renderer process: opens a scenario, and renders one task of its server after another.

``processes.start_renderer`` starts it as ``python -m simgl_bridge.render_process``.
"""

from __future__ import annotations

import socket
import sys
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from simgl.arrays import Image16
from simgl.camera.camera import Camera
from simgl.cli_progress import Activity, activity
from simgl.errors import BridgeError, SimglError
from simgl.figures.displays import thumbnail_from_dn
from simgl.interruption import report_faults
from simgl.scenario.loader import load_scenario
from simgl.scenario.scenario import Scenario
from simgl.simulator import Simulator
from simgl_bridge.basilisk.camera_overrides import (
    DEFAULT_OVERRIDES,
    CameraOverrides,
    load_camera_files,
)
from simgl_bridge.basilisk.camera_png import png_of
from simgl_bridge.basilisk.viz_scene import bare_scenario, check_base
from simgl_bridge.client_sessions import Frames
from simgl_bridge.describe_scene import served_scene
from simgl_bridge.framing import BadMessageError, error_of
from simgl_bridge.hashes import shown_state_hash
from simgl_bridge.messages import (
    Configure,
    Error,
    ErrorCode,
    Message,
    Render,
)
from simgl_bridge.operator_log import OperatorLog
from simgl_bridge.plane_compression import compressed
from simgl_bridge.preview import WIDEST
from simgl_bridge.processes import RendererOptions, end_with_parent
from simgl_bridge.render_request import RenderedImages, render_images
from simgl_bridge.render_session import GpuLostError, RenderSession, load_named
from simgl_bridge.renderer_messages import (
    ENCODER,
    TASK_DECODER,
    BasiliskPng,
    Draw,
    DrawForBasilisk,
    Drawn,
    Failure,
    Finish,
    Progress,
    ServedScene,
    Task,
)
from simgl_bridge.session_recording import SessionRecorder
from simgl_bridge.shared_frames import Connection

# Shortest time between two reports of progress [s].
_REPORT_INTERVAL = 0.1


class ServerLink:
    """The renderer's end of the link: tasks of the server, and reports to it."""

    def __init__(self, end: socket.socket) -> None:
        self._connection = Connection(end)
        self._reported = 0.0
        self.report("loading the scenario")

    def task(self) -> Message:
        """The next task; Finish where the server is gone."""
        frames = self._connection.receive()
        return TASK_DECODER.decode(frames[0]) if frames else Finish()

    def send(self, report: Message, payload: Frames = ()) -> None:
        """Send a report with its frames."""
        # Where the server is gone the next task is Finish.
        with suppress(BrokenPipeError, ConnectionResetError):
            self._connection.send([ENCODER.encode(report), *payload])

    def report(self, what: str, done: int = 0, total: int = 0) -> None:
        """Say what is being prepared; the steps of one thing at most ten times a second."""
        now = time.monotonic()
        if 0 < done < total and now < self._reported + _REPORT_INTERVAL:
            return
        self._reported = now
        self.send(Progress(what=what, done=done, total=total))

    def close(self) -> None:
        """Hang up; what was sent arrives."""
        self._connection.close()


@dataclass
class Renderer:
    """What renders the tasks of a server.

    overrides : camera parameters that Basilisk does not send, by camera id
    recorder : of images before they are sent, and of choices; None records nothing
    """

    session: RenderSession
    overrides: Mapping[int, CameraOverrides] = field(default_factory=dict)
    recorder: SessionRecorder | None = None
    log: OperatorLog = field(default_factory=OperatorLog)
    basilisk_log: OperatorLog = field(default_factory=lambda: OperatorLog("simgl: basilisk"))

    @property
    def scene(self) -> ServedScene:
        """What is served."""
        files = ", ".join(f"{i} {s.where}" for i, s in self.overrides.items()) or "none"
        return served_scene(self.session.scenario, self.session.renderer_name, files)

    def answer(self, task: Task) -> tuple[Message, Frames]:
        """The report that answers a task, with its frames."""
        try:
            return self._answer(task)
        except BadMessageError as error:
            return error_of(error), ()
        except GpuLostError as error:
            problem = f"{error}; a new context is opened"
            return self.refusal(ErrorCode.GPU_LOST, problem, retryable=True), ()
        # No task may end the service.
        except Exception as error:
            self.log.failure()
            return self.refusal(ErrorCode.INTERNAL, f"{type(error).__name__}: {error}"), ()

    def refusal(self, code: ErrorCode, problem: str, *, retryable: bool = False) -> Error:
        """The report that a task cannot be done."""
        text = self.session.without_folder(problem)
        return error_of(BadMessageError(code, "", text, retryable=retryable))

    def _answer(self, task: Task) -> tuple[Message, Frames]:
        if isinstance(task, Draw):
            return self._drawn(task)
        if isinstance(task, DrawForBasilisk):
            return BasiliskPng(), [self._png(task)]
        try:
            self.session.configure(task.scenario, task.seed)
        except GpuLostError:
            raise
        except SimglError as error:
            problem = self.session.without_folder(str(error))
            raise BadMessageError(ErrorCode.BAD_SCENE, "scenario", problem) from None
        scene = self.scene
        if self.recorder is not None:
            self.recorder.configured(task.scenario, scene.seed, scene.scene_hash)
        return scene, ()

    def _drawn(self, task: Draw) -> tuple[Message, Frames]:
        rendered = render_images(self.session, task.request)
        planes = [memoryview(plane.data).cast("B") for plane in rendered.pixels]
        if self.recorder is not None:
            seed = self.session.scenario.seed
            state_hash = shown_state_hash(task.request, rendered.images, seed)
            self.recorder.answered(
                task.request, state_hash, rendered.bodies, rendered.images, planes
            )
        if isinstance(task.request, Render) and task.request.compression:
            images, planes = compressed(rendered.images, planes)
            rendered = replace(rendered, images=images)
        return _with_preview(rendered, planes, preview=task.preview)

    def _png(self, task: DrawForBasilisk) -> bytes:
        """The image of a camera and a state; empty where there is none."""
        overrides = self.overrides.get(task.camera_id)
        if overrides is None:
            problem = "has no file: its lens and detector are the defaults"
            self.basilisk_log(f"camera {task.camera_id} {problem}")
            overrides = DEFAULT_OVERRIDES
        try:
            return png_of(self.session, task.state, task.camera_id, overrides, self.basilisk_log)
        except SimglError as error:
            self.basilisk_log(f"no image: {error}", "states without an image")
        return b""

    def close(self) -> None:
        """End the record and the logs."""
        if self.recorder is not None:
            self.recorder.close()
        self.log.close()
        self.basilisk_log.close()


OpenRenderer = Callable[[ServerLink], Renderer]


def render_tasks(end: socket.socket, open_renderer: OpenRenderer) -> int:
    """Render the tasks of a server until it has no more; returns the exit code.

    end : the renderer's, of the connection
    """
    link = ServerLink(end)
    try:
        renderer = open_renderer(link)
        with renderer.session, renderer.log.library_warnings():
            link.send(renderer.scene)
            while not isinstance(task := link.task(), Finish):
                assert isinstance(task, Draw | DrawForBasilisk | Configure)
                _answer_task(link, renderer, task)
    except SimglError as error:
        link.send(Failure(detail=str(error)))
        return 2
    finally:
        link.close()
    renderer.close()
    return 0


def _answer_task(link: ServerLink, renderer: Renderer, task: Task) -> None:
    try:
        link.send(*renderer.answer(task))
    except BridgeError as error:
        link.send(renderer.refusal(ErrorCode.INTERNAL, f"{error}: the renderer's process"))


def _with_preview(
    rendered: RenderedImages, frames: Frames, *, preview: bool
) -> tuple[Message, Frames]:
    drawn = Drawn(bodies=rendered.bodies, images=rendered.images)
    if not preview or rendered.digital is None:
        return drawn, frames
    camera, pixels = _preview(*rendered.digital)
    height, width, _ = pixels.shape
    drawn = Drawn(
        bodies=rendered.bodies,
        images=rendered.images,
        preview_camera=camera,
        preview_shape=(height, width, 3),
    )
    return drawn, [*frames, memoryview(pixels.data).cast("B")]


def _preview(camera: Camera, dn: Image16) -> tuple[str, Any]:
    """Name of a camera and (height, width, 3) uint8 sRGB pixels of its image."""
    return camera.name, np.ascontiguousarray(thumbnail_from_dn(dn, camera, WIDEST))


def open_renderer(options: RendererOptions, link: ServerLink) -> Renderer:
    """The renderer that options ask for."""
    root = None if options.root is None else Path(options.root)
    recorder = None
    if options.record is not None:
        recorder = SessionRecorder(Path(options.record), with_images=options.record_images)
    overrides = load_camera_files(list(options.camera_files), root)
    if options.chosen is not None:
        assert root is not None
        scenario = load_named(root, options.chosen)
    elif options.scenario is None:
        scenario = bare_scenario()
    else:
        scenario = load_scenario(Path(options.scenario), root=root)
    if options.basilisk:
        check_base(scenario)
    if options.seed is not None:
        scenario = replace(scenario, seed=options.seed)

    def open_simulator(scenario: Scenario) -> Simulator:
        with activity("opening OpenGL") as shown:
            preparation = _Preparation(shown, link)
            simulator = Simulator(scenario, progress=preparation)
            preparation.begin_stage("first images")
            _draw_first(simulator)
            return simulator

    session = RenderSession(scenario, root=root, open_simulator=open_simulator)
    renderer = Renderer(session, overrides, recorder)
    if recorder is not None:
        recorder.opened(renderer.scene, scenario_file=scenario.source, root=root)
    return renderer


def _draw_first(simulator: Simulator) -> None:
    """Draw each camera at the scenario's epoch: the first request then waits for no shader.

    Not by rays from every sample, which take longer than the shaders.
    """
    scenario = simulator.scenario
    if scenario.gather == "pixel":
        return
    try:
        state = scenario.at(scenario.epoch_tai_ns)
        for camera in state.cameras:
            simulator.capture(state, camera)
    except SimglError:
        # A scene that has no image at its epoch may have some at the client's poses.
        return
    except BaseException:
        simulator.close()
        raise


class _Preparation:
    """Progress of a simulator that is being opened, for the operator and for the server."""

    def __init__(self, shown: Activity, link: ServerLink) -> None:
        self._shown, self._link = shown, link
        self.begin_stage("opening OpenGL")

    def begin_stage(self, name: str) -> None:
        """The next steps are those of another computation."""
        self._name = name
        self._shown.begin_stage(name)
        self._link.report(name)

    def __call__(self, done: int, total: int) -> None:
        """Steps of a computation."""
        self._shown(done, total)
        self._link.report(self._name, done, total)


def main() -> None:
    """The process."""
    end, parent, options = sys.argv[1:]
    end_with_parent(int(parent))
    report_faults()
    decoded = msgspec.json.decode(options, type=RendererOptions)
    connection = socket.socket(fileno=int(end))
    sys.exit(render_tasks(connection, lambda link: open_renderer(decoded, link)))


if __name__ == "__main__":
    main()
