"""Resolve: the samples of a tile averaged per pixel and laid over the background."""

from __future__ import annotations

import moderngl
import numpy as np

from simgl.gpu.blocks import Block
from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.state import ONE_MINUS_SRC1_COLOR, State
from simgl.view.frame import Tile

_RESOLVE = Block(
    "Resolve",
    5,
    np.dtype(
        [
            # Columns of the 2 x 2 matrices from pixel to raster directions and back.
            ("raster_from_pixel", "f4", 4),
            ("pixel_from_raster", "f4", 4),
            # Raster coordinates of the tile's corner, and the tile's place in the image.
            ("raster_origin", "f4", 2),
            ("tile_origin", "f4", 2),
            ("reach", "i4"),
            ("resolve_padding_a", "i4"),
            ("resolve_padding_b", "i4"),
            ("resolve_padding_c", "i4"),
        ]
    ),
)


class ResolvePass:
    """Each pixel of a tile becomes mean of samples + (1 - covered share) x background."""

    state = State(blend=(moderngl.ONE, ONE_MINUS_SRC1_COLOR))
    hiding = State(blend=(moderngl.ZERO, ONE_MINUS_SRC1_COLOR))

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._program = FullscreenProgram(ctx, "resolve/resolve", _RESOLVE, ["samples"])

    def draw(self, tile: Tile, samples: moderngl.Texture, target: moderngl.Framebuffer) -> None:
        """Lay the tile over the radiance that the target already holds."""
        self._draw(self.state, tile, samples, target)

    def hide(self, tile: Tile, samples: moderngl.Texture, target: moderngl.Framebuffer) -> None:
        """Leave of what the target holds only what is seen past the tile's spacecraft."""
        self._draw(self.hiding, tile, samples, target)

    def _draw(
        self, state: State, tile: Tile, samples: moderngl.Texture, target: moderngl.Framebuffer
    ) -> None:
        box = (tile.x, tile.y, tile.width, tile.height)
        state.apply(self._ctx, target, (0, 0, *target.size), box)
        self._program.draw(_values(tile), [samples])

    def release(self) -> None:
        """Free everything."""
        self._program.release()


def _values(tile: Tile) -> dict[str, object]:
    turn = tile.lattice.turn
    return {
        "raster_from_pixel": turn.T.ravel(),
        "pixel_from_raster": np.linalg.inv(turn).T.ravel(),
        "raster_origin": tile.lattice.raster_from_pixel(tile.width)[:, 2],
        "tile_origin": (tile.x, tile.y),
        "reach": tile.lattice.reach,
    }
