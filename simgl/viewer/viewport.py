"""From view settings to the pixels of a window."""

from __future__ import annotations

import math
from dataclasses import replace

import moderngl
import numpy as np

from simgl.arrays import Image8
from simgl.camera.camera import Camera, Detector, Lens
from simgl.gpu.render_targets import ImageTarget
from simgl.passes.display import DisplayPass
from simgl.progress import ProgressCallback
from simgl.renderer import Renderer
from simgl.scenario.scenario import Scenario
from simgl.scene.state import CameraState, SceneState
from simgl.view.frame_view import frame_view
from simgl.viewer.orbit_camera import FIELD_OF_VIEW, orbit_axes
from simgl.viewer.view_settings import ViewSettings

Size = tuple[int, int]

_VIEWER = "viewer"


def window_camera(size: Size) -> Camera:
    """The orbit camera, with the window's pixels. Only its geometry is used."""
    pitch = 1e-5
    focal_length = pitch * 0.5 * size[1] / math.tan(0.5 * FIELD_OF_VIEW)
    return Camera(
        name=_VIEWER,
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


def fitted(image: Size, window: Size) -> tuple[int, int, int, int]:
    """x, y, width, height [px] of the largest centred place for an image in a window."""
    scale = min(window[0] / image[0], window[1] / image[1])
    width, height = (max(1, round(scale * side)) for side in image)
    return (window[0] - width) // 2, (window[1] - height) // 2, width, height


def _enlarged(camera: Camera, window: Size) -> Camera:
    """A camera with the same field of view and the window's pixels."""
    d = camera.detector
    _, _, width, height = fitted((d.width, d.height), window)
    pitch = d.pixel_pitch * d.width / width
    return replace(camera, detector=replace(d, width=width, height=height, pixel_pitch=pitch))


def viewer_state(scenario: Scenario, settings: ViewSettings, window: Size) -> SceneState:
    """The scene with the window's camera alone.

    window : size of its framebuffer [px]
    """
    state = scenario.at(settings.tai_ns)
    if settings.camera is not None:
        through = state.cameras[settings.camera]
        camera = replace(through, camera=_enlarged(through.camera, window))
    else:
        pose = state.bodies[settings.target].pose
        position, R_camera_from_icrf = settings.orbit.pose(pose.position, orbit_axes(pose))
        camera = CameraState(
            camera=window_camera(window),
            position=position,
            R_camera_from_icrf=R_camera_from_icrf,
        )
    return replace(state, cameras={_VIEWER: camera})


class Viewport:
    """Renders into a window's framebuffer; radiance and display are separate steps."""

    def __init__(
        self, ctx: moderngl.Context, scenario: Scenario, progress: ProgressCallback | None = None
    ) -> None:
        self.scenario = scenario
        self._renderer = Renderer(ctx)
        models = scenario.models_at_epoch() if scenario.inter_reflection else ()
        self._renderer.prepare(models, scenario.earth, scenario.joint_light, progress)
        self._display = DisplayPass(ctx)
        self._image: ImageTarget | None = None

    def render(self, settings: ViewSettings, window: Size) -> None:
        """Render the radiance; where that raises ConfigError, the last image is kept."""
        view = frame_view(
            viewer_state(self.scenario, settings, window),
            _VIEWER,
            sample_budget=self._renderer.sample_budget,
            samples_per_pixel=self.scenario.samples_per_pixel,
            inter_reflection=self.scenario.inter_reflection,
            between_spacecraft=self.scenario.between_spacecraft,
            gather=self.scenario.gather,
            glossy_reflections=self.scenario.glossy_reflections,
            joint_light=self.scenario.joint_light,
        )
        self._image = self._renderer.radiance(view)

    def show(self, settings: ViewSettings, window: Size, target: moderngl.Framebuffer) -> None:
        """Display the last image in the centre of a window, black around it."""
        assert self._image is not None
        target.clear(0.0, 0.0, 0.0, 1.0, viewport=(0, 0, *target.size))
        rectangle = fitted(self._image.size, window)
        self._display.draw(self._image.textures[0], target, rectangle, settings.exposure_value)

    def release(self) -> None:
        """Free everything."""
        self._display.release()
        self._renderer.release()

    def __enter__(self) -> Viewport:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()


def read_window(target: moderngl.Framebuffer, size: Size) -> Image8:
    """(height, width, 3) content of a window's framebuffer, row 0 at the top."""
    data = target.read(viewport=(0, 0, *size), components=3, alignment=1)
    return np.frombuffer(data, np.uint8).reshape(size[1], size[0], 3)[::-1]
