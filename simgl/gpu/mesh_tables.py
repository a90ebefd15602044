"""A mesh as textures, for shaders that know which triangle they look at."""

from __future__ import annotations

import moderngl
import numpy as np

from simgl.arrays import AnyArray, IndexArray, UIntArray
from simgl.gpu.release import all_or_nothing
from simgl.gpu.render_targets import read_by_texel

# Texels of a row of every table, as in shaders/gbuffer/triangles.glsl.
COLUMNS = 2048

# Their number shares a word of 32 bits with others; two of more surfaces may have one number.
_MAX_SURFACES = 2**20 - 1
# Of a label, as in shaders/surface/layers.glsl.
_MATERIAL = 63


def table_rows(values: AnyArray) -> AnyArray:
    """(rows, COLUMNS, c) of (n, c) texels, the last row filled up."""
    rows, channels = max(1, -(-len(values) // COLUMNS)), values.shape[1]
    if len(values) == rows * COLUMNS:
        return values.reshape(rows, COLUMNS, channels)
    table = np.zeros((rows * COLUMNS, channels), dtype=values.dtype)
    table[: len(values)] = values
    return table.reshape(rows, COLUMNS, channels)


def table(ctx: moderngl.Context, values: AnyArray) -> moderngl.Texture:
    """A texture of (n, c) texels, float32 or uint32, read texel by texel."""
    rows = table_rows(values)
    kind = "f4" if rows.dtype == np.float32 else "u4"
    texture = ctx.texture((COLUMNS, len(rows)), rows.shape[2], rows.tobytes(), dtype=kind)
    read_by_texel(texture)
    return texture


def _short_float(values: AnyArray) -> IndexArray:
    """Numbers from 2^-16 to 2^16 in 11 bits: the upper bits of float32, counted from 2^-16 on."""
    clipped = np.clip(values, 2.0**-16, 2.0**15.98).astype(np.float32)
    # Rounded up.
    return (clipped.view(np.uint32).astype(np.int64) + (1 << 17) - 1 >> 17) - (111 << 6)


class MeshTables:
    """The tables of one mesh.

    corners : for each triangle the indices of its corners, and its material
    drawn : what every sample asks for, where all triangles are drawn (``drawn_rows``)
    vertices : for each vertex, a texel each: place and label; normal; with details place in the
        images, and factors of the base colour
    """

    @all_or_nothing
    def __init__(
        self,
        ctx: moderngl.Context,
        positions: AnyArray,
        normals: AnyArray,
        label: AnyArray,
        triangles: AnyArray,
        surface: AnyArray,
        curvature: AnyArray,
        details: np.ndarray[tuple[int, ...], np.dtype[np.void]] | None,
    ) -> None:
        count = len(positions)
        texels = np.zeros((count, 2 if details is None else 4, 4), dtype=np.float32)
        texels[:, 0, :3], texels[:, 0, 3] = positions, label
        texels[:, 1, :3] = normals
        if details is not None:
            texels[:, 2, :2], texels[:, 3] = details["uv"], details["tint"]
        self.vertices = table(ctx, texels.reshape(-1, 4))
        word = (surface % _MAX_SURFACES + 1) | _short_float(curvature) << 21
        self._surface_words: UIntArray = word.astype(np.uint32)
        everything = np.arange(len(triangles), dtype=np.uint32)
        self.drawn = table(ctx, self.drawn_rows(everything))
        # Four channels: rows of three need not be aligned as drivers expect.
        corners = np.column_stack([triangles, label[triangles[:, 2]] & _MATERIAL])
        self.corners = table(ctx, corners.astype(np.uint32))

    def drawn_rows(self, numbers: UIntArray) -> UIntArray:
        """(k, 2) of triangles that are drawn: the number in the mesh of what each is, or is a part
        of; the number of its smooth surface, from 1 on, and from bit 21 on its curvature.

        numbers : (k,) in the mesh
        """
        return np.column_stack([numbers, self._surface_words.take(numbers)])

    def release(self) -> None:
        """Free everything."""
        for texture in (self.vertices, self.drawn, self.corners):
            texture.release()
