"""Triangles of a vertex array, drawn so that compiling their program holds nobody up.

A driver compiles a program when it first draws with it: llvmpipe takes 0.02 to 0.4 s, by the state
of that draw. moderngl's draws keep Python's lock, so that all other threads would stand still, such
as those that trace light before the first image.
"""

from __future__ import annotations

import ctypes

import moderngl

from simgl.gpu.window_systems import opengl_function

_TRIANGLES, _UNSIGNED_INT, _INDEX_BYTES = moderngl.TRIANGLES, 0x1405, 4
_INT, _UINT, _POINTER = ctypes.c_int, ctypes.c_uint, ctypes.c_void_p


class Triangles:
    """Draws with one program.

    indices : of four bytes; None for vertices in their order
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        program: moderngl.Program,
        indices: moderngl.Buffer | None = None,
    ) -> None:
        self._array = ctx.vertex_array(program, [], index_buffer=indices)
        self._indexed = indices is not None
        self._compiled = False

    def draw(self, vertices: int, first: int = 0) -> None:
        """So many vertices or indices, from one of them on."""
        if self._compiled:
            self._array.render(_TRIANGLES, vertices=vertices, first=first)
            return
        # Of no vertices, it binds the array and its program.
        self._array.render(_TRIANGLES, vertices=0)
        if self._indexed:
            draw = opengl_function("glDrawElements", _UINT, _INT, _UINT, _POINTER)
            draw(_TRIANGLES, vertices, _UNSIGNED_INT, _INDEX_BYTES * first)
        else:
            opengl_function("glDrawArrays", _UINT, _INT, _INT)(_TRIANGLES, first, vertices)
        self._compiled = True

    def release(self) -> None:
        """Free the array."""
        self._array.release()
