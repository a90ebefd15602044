"""A scenario in a window: settings, the captures that they ask for, and what is said of them."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import cached_property
from pathlib import Path

import moderngl

from simgl import assets
from simgl.camera.camera import Camera, Detector, Lens
from simgl.errors import ConfigError, ShaderError
from simgl.figures.displays import CameraImages, display, images_of
from simgl.output import write_capture
from simgl.progress import ProgressCallback
from simgl.scenario.scenario import Scenario
from simgl.scene.state import CameraState, SceneState
from simgl.simulator import Capture, Product, Simulator
from simgl.viewer.orbit_camera import FIELD_OF_VIEW, orbit_axes
from simgl.viewer.read_outs import info_lines, pixel_lines
from simgl.viewer.shader_watch import ShaderWatch
from simgl.viewer.subject import DnOfImage, Panel, Size
from simgl.viewer.view_commands import BY_KEY, HELP_OF_SCENARIOS, chosen_state, title
from simgl.viewer.view_settings import ViewSettings

ORBIT_CAMERA = "viewer"
_OF_A_CAMERA = frozenset({Product.DN, Product.ELECTRONS, Product.RADIANCE, Product.TRUTH})
_OF_THE_ORBIT = frozenset({Product.RADIANCE})
# Wider images are shown in false colours from fewer pixels.
_WIDEST = 2048


def window_camera(size: Size) -> Camera:
    """The orbit camera, with the window's pixels. Only its geometry is used."""
    pitch = 1e-5
    focal_length = pitch * 0.5 * size[1] / math.tan(0.5 * FIELD_OF_VIEW)
    return Camera(
        name=ORBIT_CAMERA,
        lens=Lens(focal_length=focal_length, f_number=1.0),
        detector=Detector(
            width=size[0],
            height=size[1],
            pixel_pitch=pitch,
            quantum_efficiency=(1.0, 1.0, 1.0, 1.0),
            full_well=1.0,
            read_noise=0.0,
            bits=8,
            pedestal=0.0,
            gain_dn_per_e=1.0,
        ),
        exposure_time=1.0,
    )


def viewer_state(
    scenario: Scenario, settings: ViewSettings, window: Size
) -> tuple[SceneState, str]:
    """The scene as it was chosen, and the camera to look through.

    window : size of its framebuffer [px]
    """
    state = chosen_state(scenario, settings)
    if settings.camera is not None:
        return state, settings.camera
    pose = state.bodies[settings.target].pose
    position, R_camera_from_icrf = settings.orbit.pose(pose.position, orbit_axes(pose))
    camera = CameraState(
        camera=window_camera(window),
        position=position,
        R_camera_from_icrf=R_camera_from_icrf,
    )
    return replace(state, cameras={ORBIT_CAMERA: camera}), ORBIT_CAMERA


class _Drawn:
    """A capture, with the settings and the size of the window that it was made for."""

    def __init__(
        self,
        settings: ViewSettings,
        window: Size,
        state: SceneState,
        capture: Capture,
        seconds: float,
    ) -> None:
        self.settings, self.window, self.state, self.capture = settings, window, state, capture
        self._seconds = seconds

    @cached_property
    def images(self) -> CameraImages:
        return images_of(self.capture, self._seconds)

    @property
    def placed(self) -> CameraState:
        return self.state.cameras[self.capture.info.camera.name]


class Viewport:
    """A ``Subject``: a scenario, drawn in a window's context with the settings that keys change."""

    help: Sequence[tuple[str, str]] = HELP_OF_SCENARIOS

    def __init__(
        self,
        ctx: moderngl.Context,
        scenario: Scenario,
        settings: ViewSettings,
        progress: ProgressCallback | None = None,
    ) -> None:
        self.scenario, self.settings = scenario, settings
        self._ctx = ctx
        self._simulator = Simulator(scenario, ctx, progress)
        self._watch = ShaderWatch(assets.shaders())
        self._drawn: _Drawn | None = None
        self._made_panels: tuple[tuple[object, ...], tuple[Panel, ...]] | None = None
        self.error = ""
        self.number = 0

    runs = False

    @property
    def is_playing(self) -> bool:
        """Whether time goes by."""
        return self.settings.playing

    def press(self, key: str) -> str | None:
        """Obey a key; what has changed, in words."""
        if key not in BY_KEY:
            return None
        command = BY_KEY[key]
        self._change(command.effect(self.settings, self.scenario))
        return command.says(self.settings, self.scenario)

    def _change(self, settings: ViewSettings) -> None:
        if settings != self.settings:
            self.settings = settings
            self.number += 1

    def drag(self, right: float, down: float) -> None:
        """Circle the spacecraft by two angles [rad]."""
        if self.settings.camera is None:
            self._change(replace(self.settings, orbit=self.settings.orbit.dragged(right, down)))

    def scroll(self, steps: float) -> None:
        """Come nearer."""
        if self.settings.camera is None:
            self._change(replace(self.settings, orbit=self.settings.orbit.zoomed(steps)))

    def advance(self, seconds: float) -> None:
        """Some of the user's time went by."""
        if self.settings.playing:
            self._change(self.settings.later(seconds))

    def update(self, window: Size) -> str | None:
        """Capture where the image is out of date; where that fails, go back to the last settings.

        Raises ConfigError where already the first image fails.
        """
        if self._watch.has_changed():
            return self._reload(window)
        if self._drawn is not None and self._fits(self._drawn, window):
            return None
        try:
            self._drawn = self._captured(self._simulator, window)
        except ConfigError as error:
            if self._drawn is None:
                raise
            self._change(replace(self._drawn.settings, playing=False))
            return str(error)
        self.number += 1
        return None

    def _fits(self, drawn: _Drawn, window: Size) -> bool:
        same_size = drawn.window == window or self.settings.camera is not None
        return same_size and drawn.settings.same_image(self.settings)

    def _captured(self, simulator: Simulator, window: Size) -> _Drawn:
        state, camera = viewer_state(self.scenario, self.settings, window)
        products = _OF_THE_ORBIT if self.settings.camera is None else _OF_A_CAMERA
        start = time.perf_counter()
        capture = simulator.capture(state, camera, products)
        return _Drawn(self.settings, window, state, capture, time.perf_counter() - start)

    def _reload(self, window: Size) -> str:
        """Compile the shaders as they are now; the last good ones stay where that fails."""
        self.number += 1
        with ExitStack() as undo:
            try:
                simulator = Simulator(self.scenario, self._ctx)
                undo.callback(simulator.close)
                # Variants are compiled when they are first drawn.
                self._drawn = self._captured(simulator, window)
            except ShaderError as error:
                self.error = str(error)
                return "the shaders have an error; the last good ones stay"
            undo.pop_all()
        self._simulator.close()
        self._simulator, self.error = simulator, ""
        return "shaders loaded again"

    def panels(self) -> Sequence[Panel]:
        """The images side by side."""
        drawn = self._shown
        exposure_value = self.settings.exposure_value
        key = drawn, self.settings.shown, exposure_value
        if self._made_panels is None or self._made_panels[0] != key:
            _, planes = self.settings.shown
            panels = tuple(_panel(drawn.images, plane, exposure_value) for plane in planes)
            self._made_panels = key, panels
        return self._made_panels[1]

    @property
    def _shown(self) -> _Drawn:
        assert self._drawn is not None
        return self._drawn

    def info(self) -> list[str]:
        """Lines about the images."""
        drawn = self._shown
        # What can change without a new capture is told as it now is.
        return info_lines(self.scenario, self.settings, drawn.state, drawn.placed, drawn.images)

    def pixel(self, column: int, row: int) -> list[str]:
        """Lines about a pixel."""
        return pixel_lines(self._shown.images, column, row)

    def dn(self) -> DnOfImage | None:
        """For the histogram."""
        images = self._shown.images
        dn = images.planes.get("dn")
        if dn is None or images.saturated_share is None or not self.settings.histogram:
            return None
        return DnOfImage(
            dn=dn, detector=images.camera.detector, saturated_share=images.saturated_share
        )

    def caption(self, frame_rate: float | None) -> str:
        """Of the window."""
        return title(self.settings, frame_rate)

    def save_data(self, folder: Path, name: str) -> list[Path]:
        """Write the capture as ``simgl render`` does."""
        return write_capture(self._shown.capture, folder, name)

    def release(self) -> None:
        """Free everything."""
        self._simulator.close()

    def __enter__(self) -> Viewport:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()


def _panel(images: CameraImages, plane: str, exposure_value: float) -> Panel:
    detector = images.camera.detector
    size = detector.width, detector.height
    if plane == "seen":
        return Panel(
            name="radiance",
            size=size,
            radiance=images.planes["radiance"],
            exposure_value=exposure_value,
            bands=detector.bands,
        )
    made = display(images, plane, _WIDEST)
    assert made is not None
    names = {"dn": "DN", "electrons": "mean electrons"}
    return Panel(name=names.get(plane, plane), size=size, pixels=made.pixels, scale=made.scale)
