"""Vertex buffers of meshes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import moderngl
import numpy as np

from simgl.gpu.release import all_or_nothing
from simgl.lru_cache import LruCache

# The labels: part; material, and from bit 6 on the joint.
VERTEX = np.dtype([("position", "<f4", 3), ("normal", "<f4", 3), ("labels", "<u2", 2)])
_LAYOUT = {"in_position": "3f", "in_normal": "3f", "in_labels": "2u2"}
# Kept apart, as few meshes have them: place in the images, factors of the base colour.
_DETAIL_LAYOUT = {"in_uv": "2f", "in_tint": "4f"}
DETAIL = np.dtype([("uv", "<f4", 2), ("tint", "<f4", 4)])

# More than a renderer has programs for one mesh.
_MAX_ARRAYS = 32


@dataclass(frozen=True, kw_only=True, eq=False)
class Values:
    """Attributes of vertices that change from frame to frame.

    layout : format of each attribute of a row, by name
    """

    buffer: moderngl.Buffer
    layout: Mapping[str, str]


def _read_by(program: moderngl.Program, layout: Mapping[str, str]) -> list[str]:
    """A buffer's format, and the names of the attributes that a program reads from it."""
    widths = {"1f": "4x", "2f": "8x", "3f": "12x", "4f": "16x", "2u2": "4x"}
    used = [name for name in layout if name in program]
    return [" ".join(f if n in used else widths[f] for n, f in layout.items()), *used]


class VertexBuffers:
    """One mesh on the GPU, drawable by any program that reads some of its attributes."""

    @all_or_nothing
    def __init__(
        self,
        ctx: moderngl.Context,
        positions: np.ndarray[tuple[int, ...], np.dtype[np.float32]],
        normals: np.ndarray[tuple[int, ...], np.dtype[np.float32]],
        labels: np.ndarray[tuple[int, ...], np.dtype[np.uint32]],
        triangles: np.ndarray[tuple[int, ...], np.dtype[np.uint32]],
        details: np.ndarray[tuple[int, ...], np.dtype[np.void]] | None = None,
    ) -> None:
        vertices = np.zeros(len(positions), dtype=VERTEX)
        vertices["position"] = positions
        vertices["normal"] = normals
        vertices["labels"] = labels
        self._ctx = ctx
        self._vertices = ctx.buffer(vertices.tobytes())
        self._details = None if details is None else ctx.buffer(details.tobytes())
        self._indices = ctx.buffer(triangles.astype("<u4").tobytes())
        # By the objects, not by OpenGL's names for them, which a driver may use again.
        self._arrays = LruCache[
            tuple[moderngl.Program, moderngl.Buffer | None], moderngl.VertexArray
        ](_MAX_ARRAYS, moderngl.VertexArray.release)

    def draw(self, program: moderngl.Program, values: Values | None = None) -> None:
        """All triangles with a program.

        values : further attributes, one row for each vertex; the buffer outlives this geometry
        """
        key = program, None if values is None else values.buffer
        self._arrays.get(key, lambda: self._array(program, values)).render(moderngl.TRIANGLES)

    def _array(self, program: moderngl.Program, values: Values | None) -> moderngl.VertexArray:
        content = [(self._vertices, *_read_by(program, _LAYOUT))]
        if self._details is not None and "in_uv" in program:
            content.append((self._details, *_read_by(program, _DETAIL_LAYOUT)))
        if values is not None:
            content.append((values.buffer, *_read_by(program, values.layout)))
        return self._ctx.vertex_array(program, content, self._indices)

    def release(self) -> None:
        """Free buffers and arrays."""
        self._arrays.clear()
        self._vertices.release()
        if self._details is not None:
            self._details.release()
        self._indices.release()
