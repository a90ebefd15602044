"""The one triangle that full-screen passes draw."""

from __future__ import annotations

import moderngl


class Fullscreen:
    """A draw call without vertex data over the whole viewport."""

    vertex_shader = "common/fullscreen.vert"

    def __init__(self, ctx: moderngl.Context, program: moderngl.Program) -> None:
        self._array = ctx.vertex_array(program, [])

    def draw(self) -> None:
        """Draw it."""
        self._array.render(moderngl.TRIANGLES, vertices=3)

    def release(self) -> None:
        """Free the vertex array."""
        self._array.release()
