"""Warp: what a distorting lens makes of a pinhole's image."""

from __future__ import annotations

from collections.abc import Sequence

import moderngl
import numpy as np

from simgl.camera.camera import Camera
from simgl.camera.distortion import FINER, field
from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.pipeline_state import State
from simgl.gpu.release import all_or_nothing
from simgl.gpu.render_targets import table_texture
from simgl.gpu.uniform_blocks import Block
from simgl.lru_cache import MANY, LruCache

_WARP = Block(
    "Warp",
    31,
    np.dtype([("fine_per_pixel", "f4"), ("warp_padding_a", "f4"), ("warp_padding_b", "f4", 2)]),
)

# Of the cached tables of cameras, 8 bytes a pixel; that of the last camera stays.
_MAX_BYTES = 128 << 20


class WarpPass:
    """Fills a camera's image from the finer one of its pinhole."""

    state = State()

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._mean = FullscreenProgram(ctx, "warp/warp", _WARP, ["places", "fine"])
        self._nearest = FullscreenProgram(
            ctx, "warp/nearest", _WARP, ["places", "fine_depth", "fine_part", "fine_normal"]
        )
        self._places = LruCache[object, moderngl.Texture](
            MANY, moderngl.Texture.release, max_bytes=_MAX_BYTES
        )

    def places(self, camera: Camera) -> moderngl.Texture:
        """RG32F, coordinates in the pinhole's image that the middles of the pixels see."""

        def upload() -> moderngl.Texture:
            return table_texture(self._ctx, field(camera).places)

        size = 8 * camera.detector.width * camera.detector.height
        return self._places.get(camera.geometry, upload, size)

    def mean(self, camera: Camera, fine: moderngl.Texture, target: moderngl.Framebuffer) -> None:
        """Means over the pixels of a fine RGBA32F image."""
        self.state.apply(self._ctx, target, (0, 0, *target.size))
        self._mean.draw({"fine_per_pixel": FINER}, [self.places(camera), fine])

    def nearest(
        self,
        camera: Camera,
        truth: Sequence[moderngl.Texture],
        target: moderngl.Framebuffer,
    ) -> None:
        """Depth, identity and normals of the fine pixels that the middles of the pixels see."""
        self.state.apply(self._ctx, target, (0, 0, *target.size))
        self._nearest.draw({"fine_per_pixel": FINER}, [self.places(camera), *truth])

    def release(self) -> None:
        """Free everything."""
        self._mean.release()
        self._nearest.release()
        self._places.clear()
