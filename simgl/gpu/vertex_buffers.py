"""Vertex buffers of meshes."""

from __future__ import annotations

from collections.abc import Mapping

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
        self._some: moderngl.Buffer | None = None
        # By the object, not by OpenGL's name for it, which a driver may use again.
        self._arrays = LruCache[tuple[moderngl.Program, moderngl.Buffer], moderngl.VertexArray](
            _MAX_ARRAYS, moderngl.VertexArray.release
        )

    def draw(
        self,
        program: moderngl.Program,
        triangles: np.ndarray[tuple[int, ...], np.dtype[np.uint32]] | None = None,
    ) -> None:
        """Draw with a program.

        triangles : (k, 3) corners of those to draw, no more than there are; None for all
        """
        if triangles is None:
            self._array(program, self._indices).render(moderngl.TRIANGLES)
            return
        if self._some is None:
            self._some = self._ctx.buffer(reserve=self._indices.size, dynamic=True)
        self._some.write(np.ascontiguousarray(triangles, dtype="<u4").data)
        self._array(program, self._some).render(moderngl.TRIANGLES, vertices=triangles.size)

    def _array(self, program: moderngl.Program, indices: moderngl.Buffer) -> moderngl.VertexArray:
        def made() -> moderngl.VertexArray:
            content = [(self._vertices, *_read_by(program, _LAYOUT))]
            if self._details is not None and "in_uv" in program:
                content.append((self._details, *_read_by(program, _DETAIL_LAYOUT)))
            return self._ctx.vertex_array(program, content, indices)

        return self._arrays.get((program, indices), made)

    def release(self) -> None:
        """Free buffers and arrays."""
        self._arrays.clear()
        self._vertices.release()
        if self._details is not None:
            self._details.release()
        self._indices.release()
        if self._some is not None:
            self._some.release()
