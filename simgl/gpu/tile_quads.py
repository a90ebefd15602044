"""Draws over some of the square tiles of an image."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import moderngl
import numpy as np
from numpy.typing import NDArray

from simgl.arrays import IndexArray
from simgl.gpu.program import load_program
from simgl.gpu.release import all_or_nothing
from simgl.gpu.triangles import Triangles
from simgl.gpu.uniform_blocks import Block

# Edge of the largest tiles [pixels]; those of the next sizes have half of it, a quarter and so on.
LARGEST_TILE = 32
# A corner's index says where it lies: no buffer holds it. Wide enough for images of 17,000 pixels
# and tiles of 8; llvmpipe finds corners shaded before by the last 8 bits of their index, and so
# those of the row above where a row has up to 128 tiles.
_ROW, _SIZE = 2176, 1 << 24

Faces = NDArray[np.uint32]


def tile_faces(x: IndexArray, y: IndexArray, size: int, width: int = 1, height: int = 1) -> Faces:
    """(n, 6) indices of the two triangles of each of some rectangles.

    x, y : (n,) of the first tile, in tiles from the image's corner
    size : of these tiles: each more halves their edge
    width, height : of the rectangles, in tiles
    """
    right, down = width, height * _ROW
    corners = np.array([0, right, down, down, right, right + down], dtype=np.uint32)
    return (size * _SIZE + y * _ROW + x).astype(np.uint32)[:, None] + corners


class TileFaces:
    """The faces that are drawn next."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self.buffer = ctx.buffer(reserve=24, dynamic=True)

    def write(self, faces: Faces) -> None:
        """Replace them: (n, 6) of ``tile_faces``."""
        if len(faces):
            self.buffer.orphan(faces.nbytes)
            self.buffer.write(faces.data)

    def release(self) -> None:
        """Free the buffer."""
        self.buffer.release()


class TileQuads:
    """The shader ``NAME.frag``, drawn over tiles.

    faces : that it draws; several programs share them
    vertex : vertex stage, which calls ``tile_corner()`` of ``common/tile_corner.glsl``
    samplers : their texture units
    shared : blocks that it reads, bound by whoever owns them
    """

    @all_or_nothing
    def __init__(
        self,
        ctx: moderngl.Context,
        name: str,
        faces: TileFaces,
        vertex: str,
        samplers: Mapping[str, int],
        defines: Sequence[str],
        *,
        shared: Sequence[Block],
        spare: Sequence[Block] = (),
    ) -> None:
        corners = {"TILE_ROW": _ROW, "TILE_SIZE": _SIZE, "LARGEST_TILE": LARGEST_TILE}
        self._program = load_program(
            ctx,
            name,
            vertex=vertex,
            blocks=shared,
            spare=spare,
            samplers=samplers,
            defines=dict.fromkeys(defines, 1) | corners,
        )
        self._triangles = Triangles(ctx, self._program, faces.buffer)

    def draw(self, first: int, count: int) -> None:
        """So many faces, from one of them on."""
        self._triangles.draw(6 * count, first=6 * first)

    def release(self) -> None:
        """Free everything."""
        self._triangles.release()
        self._program.release()
