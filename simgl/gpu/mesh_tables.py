"""A mesh as textures, for shaders that know which triangle they look at."""

from __future__ import annotations

import moderngl
import numpy as np

from simgl.arrays import AnyArray
from simgl.gpu.release import all_or_nothing

# Texels of a row of every table, as in shaders/gbuffer/triangles.glsl.
COLUMNS = 2048

# Their number shares a word of 32 bits with others; two of more surfaces may have one number.
_MAX_SURFACES = 2**20 - 1


def table_rows(values: AnyArray) -> AnyArray:
    """(rows, COLUMNS, 4) of (n, 4) texels, the last row filled up."""
    rows = max(1, -(-len(values) // COLUMNS))
    table = np.zeros((rows * COLUMNS, 4), dtype=values.dtype)
    table[: len(values)] = values
    return table.reshape(rows, COLUMNS, 4)


def table(ctx: moderngl.Context, values: AnyArray) -> moderngl.Texture:
    """A texture of (n, 4) texels, float32 or uint32, read texel by texel."""
    rows = table_rows(values)
    kind = "f4" if rows.dtype == np.float32 else "u4"
    texture = ctx.texture((COLUMNS, len(rows)), 4, rows.tobytes(), dtype=kind)
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return texture


class MeshTables:
    """The tables of one mesh.

    corners : for each triangle the indices of its corners; the number of its surface, from 1 on,
        and from bit 21 on the logarithm of its curvature
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
        # 0 where it is flat; 32 steps to a factor of 2.
        code = np.clip(np.round(32.0 * (np.log2(np.maximum(curvature, 1e-9)) + 16.0)), 0, 1023)
        last = (surface % _MAX_SURFACES + 1) | code.astype(np.int64) << 21
        corners = np.column_stack([triangles, last]).astype(np.uint32)
        self.corners = table(ctx, corners)

    def release(self) -> None:
        """Free everything."""
        self.vertices.release()
        self.corners.release()
