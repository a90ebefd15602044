"""Whether a driver can draw the images of a camera."""

from __future__ import annotations

import moderngl

from simgl.camera.camera import Camera
from simgl.camera.pinhole_fields import pinhole_fields
from simgl.errors import ConfigError
from simgl.gpu.context import current
from simgl.gpu.render_targets import drawable_part, largest_edge

# Of an image that every driver draws: 64 MB for each of its targets.
_SURE_PIXELS = 1 << 22


class ImageSizes:
    """What sizes of images were tried on a driver."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._drawable: dict[tuple[int, int], tuple[int, int]] = {}

    def check(self, camera: Camera) -> None:
        """Raise ConfigError for a camera whose images this driver cannot draw."""
        drawn = [camera] if camera.is_pinhole else [one.centred for one in pinhole_fields(camera)]
        detector = max((one.detector for one in drawn), key=lambda d: d.width * d.height)
        size = detector.width, detector.height
        if size[0] * size[1] <= _SURE_PIXELS and max(size) <= largest_edge(self._ctx):
            return
        if size not in self._drawable:
            with current(self._ctx):
                self._drawable[size] = drawable_part(self._ctx, size)
        possible = self._drawable[size]
        if possible != size:
            given = f"{camera.detector.width} x {camera.detector.height}"
            if not camera.is_pinhole:
                given += f", for whose distortion {size[0]} x {size[1]} are drawn"
            renderer = self._ctx.info["GL_RENDERER"]
            other = f"{possible[0]} x {possible[1]}"
            problem = f"are {given}; {renderer} cannot draw that, but could draw {other}"
            raise ConfigError(f"[camera.{camera.name}]", "width_px, height_px", problem)
