"""Optics: from the radiance that a camera sees to the irradiance of its image plane."""

from __future__ import annotations

import moderngl
import numpy as np

from simgl.camera.camera import Camera
from simgl.camera.camera_equation import irradiance_per_radiance
from simgl.camera.distortion import relative_illumination
from simgl.camera.lens import Vignetting
from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.pipeline_state import State
from simgl.gpu.release import all_or_nothing
from simgl.gpu.render_targets import table_texture
from simgl.gpu.uniform_blocks import Block
from simgl.lru_cache import MANY, LruCache

_OPTICS = Block(
    "Optics",
    6,
    np.dtype([("intrinsics", "f4", 4), ("irradiance_per_radiance", "f4", 4)]),
)


# Of the cached maps of cameras, 4 bytes a pixel; that of the last camera stays.
_MAX_BYTES = 128 << 20


class OpticsPass:
    """The lens: E = pi L T cos^4 / (4 N^2), or with a map in the place of cos^4."""

    state = State()

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._program = FullscreenProgram(ctx, "optics/optics", _OPTICS, ["radiance"])
        self._mapped = FullscreenProgram(
            ctx, "optics/optics", _OPTICS, ["radiance", "relative_illumination"], ["MAPPED"]
        )
        self._maps = LruCache[object, moderngl.Texture](
            MANY, moderngl.Texture.release, max_bytes=_MAX_BYTES
        )

    def draw(
        self, camera: Camera, radiance: moderngl.Texture, target: moderngl.Framebuffer
    ) -> None:
        """Fill an RGBA32F target with irradiance per band [W m-2]."""
        k = camera.intrinsics
        self.state.apply(self._ctx, target, (0, 0, *target.size))
        values = {
            "intrinsics": (k[0, 0], k[1, 1], k[0, 2], k[1, 2]),
            "irradiance_per_radiance": irradiance_per_radiance(camera),
        }
        relative = self.relative_illumination(camera)
        if relative is None:
            self._program.draw(values, [radiance])
        else:
            self._mapped.draw(values, [radiance, relative])

    def relative_illumination(self, camera: Camera) -> moderngl.Texture | None:
        """The map of what a lens leaves off its axis; None where that is cos^4."""
        if camera.lens.vignetting == Vignetting() and camera.is_pinhole:
            return None
        return self._maps.get(
            (camera.geometry, camera.lens.vignetting),
            lambda: table_texture(self._ctx, relative_illumination(camera)),
            4 * camera.detector.width * camera.detector.height,
        )

    def release(self) -> None:
        """Free everything."""
        self._program.release()
        self._mapped.release()
        self._maps.clear()
