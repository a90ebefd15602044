"""The scene as one camera sees it, at one instant or while it moves, drawn when first needed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

from simgl.arrays import Array
from simgl.camera.camera import Camera
from simgl.camera.point_spread import SunInCamera
from simgl.camera_pipeline import ColourLight
from simgl.gpu.render_targets import ImageTarget
from simgl.images import FrameInfo
from simgl.renderer import Renderer
from simgl.scene.lamps import LampState
from simgl.scene.state import SceneState
from simgl.view.exposure_parts import ExposurePart, MovingScene
from simgl.view.frame_view import FrameView, behind_spacecraft


@dataclass(frozen=True, kw_only=True, eq=False)
class MovingViews:
    """A scene over an exposure, and what is drawn of its parts."""

    scene: MovingScene
    view_of: Callable[[ExposurePart], FrameView]

    def lit_by(self, lamps_of: Callable[[SceneState], tuple[LampState, ...]]) -> MovingViews:
        """The same with other lamps."""
        at = self.scene.at

        def lit(offset: float) -> SceneState:
            state = at(offset)
            return replace(state, lamps=lamps_of(state))

        return replace(self, scene=replace(self.scene, at=lit))


@dataclass(eq=False)
class StillScene:
    """The scene as one camera sees it at one instant.

    moving : over its exposure instead; None for the instant
    """

    renderer: Renderer
    state: SceneState
    view: FrameView
    info: FrameInfo
    moving: MovingViews | None = None
    # With the lamps as a detector responds to them: the last, whose radiance is still valid.
    lit: dict[bytes, StillScene] = field(default_factory=dict)

    @cached_property
    def radiance(self) -> ImageTarget:
        """Rendered at the first use; valid until the renderer draws another scene of this size."""
        if self.moving is None:
            return self.renderer.radiance(self.view)
        return self.renderer.radiance_during(self._behind(), self._parts())

    @property
    def lit_area(self) -> tuple[int, int, int, int]:
        """x, y, width, height of the pixels that are not black for sure."""
        d = self.view.camera.detector
        return self.view.lit_area if self.moving is None else (0, 0, d.width, d.height)

    def _behind(self) -> Iterator[tuple[FrameView, Array]]:
        assert self.moving is not None
        for state, share in self.moving.scene.behind():
            yield behind_spacecraft(self.view, state), share

    def _parts(self) -> Iterator[tuple[FrameView, Array]]:
        assert self.moving is not None
        for part in self.moving.scene.parts():
            yield self.moving.view_of(part), part.shares

    @property
    def sun(self) -> SunInCamera:
        """The Sun in camera axes, dimmed by the Earth and the Moon."""
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
            radiance=self.radiance,
            sun=self.sun,
        )

    def with_camera(self, camera: Camera, draw: int) -> StillScene:
        """The same scene and radiance with other settings of the camera and another draw."""
        placed = replace(self.state.cameras[camera.name], camera=camera)
        still = StillScene(
            renderer=self.renderer,
            state=replace(self.state, cameras={**self.state.cameras, camera.name: placed}),
            view=replace(self.view, camera=camera),
            info=replace(self.info, camera=camera, draw=draw),
            lit=self.lit,
        )
        still.radiance = self.radiance
        return still
