"""Warp: what a distorting lens makes of a pinhole's image."""

from __future__ import annotations

from collections.abc import Sequence

import moderngl
import numpy as np

from simgl.camera.pinhole_fields import FINER, PinholeField
from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.pipeline_state import State
from simgl.gpu.release import all_or_nothing
from simgl.gpu.render_targets import table_texture
from simgl.gpu.uniform_blocks import Block
from simgl.lru_cache import MANY, LruCache

_WARP = Block(
    "Warp",
    31,
    np.dtype(
        [
            ("fine_per_pixel", "f4"),
            ("pinhole_focal_px", "f4"),
            ("pinhole_boresight_px", "f4", 2),
            # Turns from the pinhole's axes to the camera's.
            ("camera_from_pinhole", "f4", (4, 4)),
        ]
    ),
)

# Of the cached tables of cameras, 12 bytes a pixel; that of the last one stays.
_MAX_BYTES = 512 << 20


class WarpPass:
    """Fills a camera's image from the finer images of its pinholes."""

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

    def places(self, field: PinholeField) -> moderngl.Texture:
        """RGB32F, coordinates in the pinhole's image that the middles of the pixels see, and
        whether a pixel is drawn through it."""

        def upload() -> moderngl.Texture:
            drawn = field.drawn[..., None].astype(np.float32)
            return table_texture(self._ctx, np.concatenate([field.places, drawn], axis=-1))

        return self._places.get(field.key, upload, 12 * field.drawn.size)

    def mean(
        self, field: PinholeField, fine: moderngl.Texture, target: moderngl.Framebuffer
    ) -> None:
        """Means over the pixels of a fine RGBA32F image."""
        self.state.apply(self._ctx, target, (0, 0, *target.size))
        self._mean.draw(_values(field), [self.places(field), fine])

    def nearest(
        self,
        field: PinholeField,
        truth: Sequence[moderngl.Texture],
        target: moderngl.Framebuffer,
    ) -> None:
        """Depth, identity and normals of the fine pixels that the middles of the pixels see, the
        first and the last along the camera's axes."""
        self.state.apply(self._ctx, target, (0, 0, *target.size))
        self._nearest.draw(_values(field), [self.places(field), *truth])

    def release(self) -> None:
        """Free everything."""
        self._mean.release()
        self._nearest.release()
        self._places.clear()


def _values(field: PinholeField) -> dict[str, object]:
    turn = np.zeros((4, 4))
    turn[:3, :3] = field.R_pinhole_from_camera.T
    return {
        "fine_per_pixel": FINER,
        "pinhole_focal_px": field.pinhole.focal_length_px,
        "pinhole_boresight_px": field.pinhole.principal_point,
        "camera_from_pinhole": turn,
    }
