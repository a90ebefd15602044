"""The scene as one camera sees it, at one instant or while it moves, drawn when first needed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache

from simgl.camera.camera import Camera
from simgl.camera.pixel_ramp import SHARP, Ramps, pixel_ramps
from simgl.camera.point_spread import SunInCamera, has_spread
from simgl.gpu.render_targets import ImageTarget
from simgl.images import FrameInfo
from simgl.rendering.camera_pipeline import ColourLight
from simgl.rendering.renderer import Renderer
from simgl.scene.state import SceneState
from simgl.view.exposure_views import MovingViews
from simgl.view.frame_view import FrameView


@dataclass(eq=False)
class StillScene:
    """The scene as one camera sees it at one instant.

    make_view : what the camera draws, made at the first call and kept
    moving : over its exposure instead; None for the instant
    """

    renderer: Renderer
    state: SceneState
    make_view: Callable[[], FrameView]
    info: FrameInfo
    moving: MovingViews | None = None
    # With the lamps as a detector responds to them: the last, whose radiance is still valid.
    lit: dict[bytes, StillScene] = field(default_factory=dict)
    # The radiance by the widths of its ramps [px].
    drawn: dict[Ramps, ImageTarget] = field(default_factory=dict)

    @property
    def view(self) -> FrameView:
        """What the camera draws; raises ConfigError where it stands inside a body or the Earth."""
        return self.make_view()

    @property
    def camera(self) -> Camera:
        """With the settings of this image."""
        return self.info.camera

    @property
    def radiance(self) -> ImageTarget:
        """Rendered at the first use; valid until the renderer draws another scene of this size."""
        return self._with_ramps(SHARP)

    @property
    def softened(self) -> ImageTarget:
        """The radiance with the ramps between pixels that the camera's point spread takes; valid as
        ``radiance`` is."""
        return self._with_ramps(pixel_ramps(self.camera))

    def _with_ramps(self, ramps: Ramps) -> ImageTarget:
        if ramps not in self.drawn:
            self.drawn[ramps] = self._render(ramps)
        return self.drawn[ramps]

    def _render(self, ramps: Ramps) -> ImageTarget:
        if self.moving is None:
            return self.renderer.radiance(replace(self.view, ramps=ramps))
        return self.renderer.radiance_during(replace(self.moving, ramps=ramps))

    @property
    def lit_area(self) -> tuple[int, int, int, int]:
        """x, y, width, height of the pixels of ``softened`` that are not black for sure."""
        camera = self.camera
        if self.moving is not None:
            return 0, 0, camera.detector.width, camera.detector.height
        return replace(self.view, ramps=pixel_ramps(camera)).lit_area

    @property
    def sun(self) -> SunInCamera | None:
        """The Sun in camera axes, dimmed by the Earth and the Moon; None for a lens that spreads no
        light, which has no ghosts."""
        if not has_spread(self.camera):
            return None
        info = self.info
        return SunInCamera(
            direction=info.R_camera_from_icrf @ info.sun_direction_icrf,
            irradiance=info.sun_irradiance * self.state.sunlight(info.position),
            angular_radius=self.state.sun.seen_from(info.position).angular_radius,
        )

    def lit_for(self, camera: Camera) -> ColourLight:
        """As the pixels of one colour of a camera see it."""
        return ColourLight(
            camera=camera,
            photons_per_joule=self.state.sun.photons_per_joule,
            radiance=self.softened,
            sun=self.sun,
        )

    def with_camera(self, camera: Camera, draw: int) -> StillScene:
        """The same scene and radiance with other settings of the camera and another draw."""
        placed = replace(self.state.cameras[camera.name], camera=camera)
        return StillScene(
            renderer=self.renderer,
            state=replace(self.state, cameras={**self.state.cameras, camera.name: placed}),
            make_view=cache(lambda: replace(self.view, camera=camera)),
            info=replace(self.info, camera=camera, draw=draw),
            lit=self.lit,
            drawn=self.drawn,
        )
