"""Draws over some of the square tiles of an image."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import moderngl
import numpy as np

from simgl.arrays import Mask
from simgl.gpu.program import load_program
from simgl.gpu.release import all_or_nothing
from simgl.gpu.uniform_blocks import Block
from simgl.lru_cache import LruCache

# Of the masks in use: a view has a few, and images of other sizes have others.
_MAX_INSTANCES = 16


class TileQuads:
    """The shaders ``NAME.vert`` and ``NAME.frag``, drawn over tiles.

    The vertex shader reads ``corner``: a tile's corner from that of the viewport [pixels].

    samplers : their texture units
    shared : blocks that it reads, bound by whoever owns them
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        name: str,
        samplers: Mapping[str, int],
        defines: Sequence[str],
        *,
        shared: Sequence[Block],
        spare: Sequence[Block] = (),
    ) -> None:
        self._program = load_program(
            ctx,
            name,
            blocks=shared,
            spare=spare,
            samplers=samplers,
            defines=dict.fromkeys(defines, 1),
        )
        self._ctx = ctx
        self._instances = LruCache[tuple[int, int], _QuadInstances](
            _MAX_INSTANCES, _QuadInstances.release
        )

    def draw(self, tiles: Mask, edge: int, slot: int = 0) -> None:
        """The tiles of a mask (rows, columns).

        edge : of a tile [pixels]
        slot : masks of one edge that are drawn in turn each keep their faces in a slot
        """
        if not tiles.any():
            return

        def made() -> _QuadInstances:
            return _QuadInstances(self._ctx, self._program, edge)

        self._instances.get((edge, slot), made).draw(tiles)

    def release(self) -> None:
        """Free everything."""
        self._instances.clear()
        self._program.release()


class _QuadInstances:
    """The faces of one mask, uploaded when it changes."""

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context, program: moderngl.Program, edge: int) -> None:
        self._edge = edge
        self._corners = ctx.buffer(reserve=16, dynamic=True)
        self._indices = ctx.buffer(reserve=16, dynamic=True)
        self._array = ctx.vertex_array(
            program, [(self._corners, "2f", "corner")], index_buffer=self._indices
        )
        self._drawn: tuple[tuple[int, ...], bytes] | None = None
        self._count = 0

    def draw(self, tiles: Mask) -> None:
        key = tiles.shape, tiles.tobytes()
        if key != self._drawn:
            self._drawn = None
            row, column = np.nonzero(tiles)
            rows, columns = tiles.shape
            y, x = np.mgrid[: rows + 1, : columns + 1]
            corners = self._edge * np.stack([x, y], axis=-1).astype(np.float32)
            first = row * (columns + 1) + column
            below = first + columns + 1
            faces = np.stack([first, first + 1, below, below, first + 1, below + 1], axis=1)
            for buffer, data in ((self._corners, corners), (self._indices, faces.astype("<u4"))):
                buffer.orphan(max(data.nbytes, 16))
                buffer.write(data.tobytes())
            self._drawn, self._count = key, 6 * row.size
        self._array.render(moderngl.TRIANGLES, vertices=self._count)

    def release(self) -> None:
        for item in (self._array, self._corners, self._indices):
            item.release()
