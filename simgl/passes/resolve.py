"""Resolve: the samples of a tile averaged per pixel and laid over the background."""

from __future__ import annotations

import moderngl
import numpy as np

from simgl.gpu.blocks import Block, UniformBuffer
from simgl.gpu.fullscreen import Fullscreen
from simgl.gpu.program import load_program
from simgl.gpu.state import ONE_MINUS_SRC1_COLOR, State
from simgl.lattice import MAX_SAMPLES
from simgl.view import Tile

_PAIRS = (MAX_SAMPLES + 1) // 2

_RESOLVE = Block(
    "Resolve",
    5,
    np.dtype(
        [
            ("sample_offsets", "i4", (_PAIRS, 4)),
            # a, b and the raster texel at the centre of the tile's first pixel
            ("raster", "i4", 4),
            ("tile_origin", "i4", 4),
            ("sample_count", "i4"),
            ("resolve_padding_a", "i4"),
            ("resolve_padding_b", "i4"),
            ("resolve_padding_c", "i4"),
        ]
    ),
)


class ResolvePass:
    """Each pixel of a tile becomes mean of samples + (1 - covered share) x background."""

    state = State(blend=(moderngl.ONE, ONE_MINUS_SRC1_COLOR))

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._program = load_program(
            ctx,
            "resolve/resolve",
            vertex=Fullscreen.vertex_shader,
            blocks=[_RESOLVE],
            samplers=["samples"],
        )
        self._fullscreen = Fullscreen(ctx, self._program)
        self._block = UniformBuffer(ctx, _RESOLVE)

    def draw(self, tile: Tile, samples: moderngl.Texture, target: moderngl.Framebuffer) -> None:
        """Lay the tile over the radiance that the target already holds."""
        box = (tile.x, tile.y, tile.width, tile.height)
        self.state.apply(self._ctx, target, (0, 0, *target.size), box)
        self._block.write(_values(tile))
        self._block.bind()
        samples.use(0)
        self._fullscreen.draw()

    def release(self) -> None:
        """Free everything."""
        for resource in (self._fullscreen, self._block, self._program):
            resource.release()


def _values(tile: Tile) -> dict[str, object]:
    lattice = tile.lattice
    offsets = np.zeros((_PAIRS * 2, 2), dtype=np.int32)
    offsets[: lattice.samples] = lattice.offsets
    centre = lattice.raster_from_pixel(tile.width) @ np.array([0.5, 0.5, 1.0])
    return {
        "sample_offsets": offsets.reshape(_PAIRS, 4),
        "raster": (lattice.a, lattice.b, *np.floor(centre).astype(int)),
        "tile_origin": (tile.x, tile.y, 0, 0),
        "sample_count": lattice.samples,
        "resolve_padding_a": 0,
        "resolve_padding_b": 0,
        "resolve_padding_c": 0,
    }
