"""The scene as one camera sees it, at one instant or while it moves, drawn when first needed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache

from simgl.camera.camera import Camera
from simgl.camera.image_margin import image_margin
from simgl.camera.pixel_ramp import SHARP, Ramps, pixel_ramps
from simgl.camera.point_spread import SunInCamera, has_spread
from simgl.gpu.render_targets import ImageTarget
from simgl.images import FrameInfo
from simgl.rendering.camera_pipeline import ColourLight
from simgl.rendering.renderer import Renderer
from simgl.scene.state import SceneState
from simgl.view.exposure_views import MovingViews
from simgl.view.frame_view import FrameView


def with_settings(state: SceneState, camera: Camera) -> SceneState:
    """A state in which the camera of that name has other settings."""
    placed = replace(state.cameras[camera.name], camera=camera)
    return replace(state, cameras={**state.cameras, camera.name: placed})


@dataclass(eq=False)
class StillScene:
    """The scene as one camera sees it at one instant.

    make_view : what the camera draws with so many pixels around its image, made at the first call
        and kept
    moving : over its exposure instead, drawn with the margin of ``softened``; None for the instant
    """

    renderer: Renderer
    state: SceneState
    make_view: Callable[[int], FrameView]
    info: FrameInfo
    moving: MovingViews | None = None
    # With the lamps as a detector responds to them: the last, whose radiance is still valid.
    lit: dict[bytes, StillScene] = field(default_factory=dict)
    # The radiance by the widths of its ramps and the margin around the image [px].
    drawn: dict[tuple[Ramps, int], ImageTarget] = field(default_factory=dict)

    @property
    def view(self) -> FrameView:
        """What the camera draws; raises ConfigError where it stands inside a body or the Earth."""
        return self.make_view(0)

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
        """The radiance with the ramps between pixels that the camera's point spread takes, and with
        the ``image_margin`` from which it brings light; valid as ``radiance`` is."""
        return self._with_ramps(pixel_ramps(self.camera), image_margin(self.camera))

    def _with_ramps(self, ramps: Ramps, margin: int = 0) -> ImageTarget:
        if (ramps, margin) not in self.drawn:
            self.drawn[ramps, margin] = self._render(ramps, margin)
        return self.drawn[ramps, margin]

    def _render(self, ramps: Ramps, margin: int) -> ImageTarget:
        if self.moving is None:
            return self.renderer.radiance(replace(self.make_view(margin), ramps=ramps))
        return self.renderer.radiance_during(replace(self.moving, ramps=ramps))

    @property
    def lit_area(self) -> tuple[int, int, int, int]:
        """x, y, width, height of the pixels of ``softened`` that are not black for sure."""
        camera, margin = self.camera, image_margin(self.camera)
        if self.moving is not None:
            d = camera.with_margin(margin).detector
            return 0, 0, d.width, d.height
        return replace(self.make_view(margin), ramps=pixel_ramps(camera)).lit_area

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
        return StillScene(
            renderer=self.renderer,
            state=with_settings(self.state, camera),
            make_view=cache(
                lambda margin: replace(self.make_view(margin), camera=camera.with_margin(margin))
            ),
            info=replace(self.info, camera=camera, draw=draw),
            lit=self.lit,
            drawn=self.drawn,
        )
