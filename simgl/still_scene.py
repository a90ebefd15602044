"""The scene as one camera sees it at one instant, drawn when it is first needed."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

from simgl.arrays import Array
from simgl.camera.camera import Camera
from simgl.camera.point_spread import SunInCamera
from simgl.camera_pipeline import ExposurePart
from simgl.gpu.render_targets import ImageTarget
from simgl.images import FrameInfo
from simgl.renderer import Renderer
from simgl.scene.state import SceneState
from simgl.view.frame_view import FrameView


@dataclass(eq=False)
class StillScene:
    """The scene as one camera sees it at one instant."""

    renderer: Renderer
    state: SceneState
    view: FrameView
    info: FrameInfo
    # With the lamps as a detector responds to them: the last, whose radiance is still valid.
    lit: dict[bytes, StillScene] = field(default_factory=dict)

    @cached_property
    def radiance(self) -> ImageTarget:
        """Rendered at the first use; valid until the renderer draws another scene of this size."""
        return self.renderer.radiance(self.view)

    @property
    def sun(self) -> SunInCamera:
        """The Sun in camera axes, dimmed by the Earth and the Moon."""
        info = self.info
        return SunInCamera(
            direction=info.R_camera_from_icrf @ info.sun_direction_icrf,
            irradiance=info.sun_irradiance * self.state.sunlight(info.position),
            angular_radius=self.state.sun.seen_from(info.position).angular_radius,
        )

    def exposed(self, camera: Camera, shares: Array) -> ExposurePart:
        """As an instant of an exposure of a camera; shares: (height,) its weight in each row."""
        return ExposurePart(
            camera=camera,
            photons_per_joule=self.state.sun.photons_per_joule,
            radiance=self.radiance,
            sun=self.sun,
            shares=shares,
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
