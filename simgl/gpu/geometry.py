"""Vertex buffers of meshes."""

from __future__ import annotations

import moderngl
import numpy as np

VERTEX = np.dtype([("position", "<f4", 3), ("normal", "<f4", 3), ("labels", "<u2", 2)])
_LAYOUT = {"in_position": "3f", "in_normal": "3f", "in_labels": "2u2"}


class Geometry:
    """One mesh on the GPU, drawable by any program that reads some of its attributes."""

    def __init__(
        self,
        ctx: moderngl.Context,
        positions: np.ndarray[tuple[int, ...], np.dtype[np.float32]],
        normals: np.ndarray[tuple[int, ...], np.dtype[np.float32]],
        labels: np.ndarray[tuple[int, ...], np.dtype[np.uint32]],
        triangles: np.ndarray[tuple[int, ...], np.dtype[np.uint32]],
    ) -> None:
        vertices = np.zeros(len(positions), dtype=VERTEX)
        vertices["position"] = positions
        vertices["normal"] = normals
        vertices["labels"] = labels
        self._ctx = ctx
        self._vertices = ctx.buffer(vertices.tobytes())
        self._indices = ctx.buffer(triangles.astype("<u4").tobytes())
        self._arrays: dict[int, moderngl.VertexArray] = {}

    def draw(self, program: moderngl.Program) -> None:
        """All triangles with a program."""
        if program.glo not in self._arrays:
            formats, names = [], []
            for name, layout in _LAYOUT.items():
                used = name in program
                width = layout.replace("3f", "12x").replace("2u2", "4x")
                formats.append(layout if used else width)
                names += [name] if used else []
            content = [(self._vertices, " ".join(formats), *names)]
            self._arrays[program.glo] = self._ctx.vertex_array(program, content, self._indices)
        self._arrays[program.glo].render(moderngl.TRIANGLES)

    def release(self) -> None:
        """Free buffers and arrays."""
        for array in self._arrays.values():
            array.release()
        self._vertices.release()
        self._indices.release()
