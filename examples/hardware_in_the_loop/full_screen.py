"""A screen that shows code values as they are: one texel a pixel, nothing scaled or converted."""

from __future__ import annotations

import os
import sys
import time
from typing import Any

import glfw
import moderngl
import numpy as np

from simgl.arrays import Image8
from simgl.errors import ContextError

_VERTEX = """
#version 330
void main() {
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    gl_Position = vec4(4.0 * corner - 1.0, 0.0, 1.0);
}
"""
_FRAGMENT = """
#version 330
uniform sampler2D codes;
out vec4 colour;
void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    int row = textureSize(codes, 0).y - 1 - pixel.y;
    colour = vec4(texelFetch(codes, ivec2(pixel.x, row), 0).rrr, 1.0);
}
"""


class FullScreen:
    """A window that fills a monitor.

    monitor : number of the monitor, from 0

    Raises ContextError where there is no display, no such monitor or no OpenGL 3.3.
    """

    def __init__(self, monitor: int = 0) -> None:
        names = ("DISPLAY", "WAYLAND_DISPLAY")
        if sys.platform.startswith("linux") and not any(os.environ.get(name) for name in names):
            raise ContextError("no display: DISPLAY is not set", "start a display server")
        glfw.ERROR_REPORTING = "raise"
        try:
            glfw.init()
            monitors = glfw.get_monitors()
            if not 0 <= monitor < len(monitors):
                remedy = f"choose one of 0 to {len(monitors) - 1}"
                raise ContextError(f"no monitor {monitor}", remedy)
            self._window = self._opened(monitors[monitor])
        except glfw.GLFWError as error:
            glfw.terminate()
            raise ContextError(f"no window: {error}", "needs a display with OpenGL 3.3") from None
        self._ctx = moderngl.create_context(require=330)
        self.size: tuple[int, int] = glfw.get_framebuffer_size(self._window)
        self._codes = self._ctx.texture(self.size, 1, alignment=1)
        program = self._ctx.program(vertex_shader=_VERTEX, fragment_shader=_FRAGMENT)
        self._triangle = self._ctx.vertex_array(program, [])

    def _opened(self, monitor: Any) -> Any:
        mode = glfw.get_video_mode(monitor)
        hints = {
            glfw.CONTEXT_VERSION_MAJOR: 3,
            glfw.CONTEXT_VERSION_MINOR: 3,
            glfw.OPENGL_PROFILE: glfw.OPENGL_CORE_PROFILE,
            glfw.OPENGL_FORWARD_COMPAT: True,
            glfw.AUTO_ICONIFY: False,
        }
        for hint, value in hints.items():
            glfw.window_hint(hint, value)
        window = glfw.create_window(*mode.size, "simgl", monitor, None)
        glfw.make_context_current(window)
        glfw.set_input_mode(window, glfw.CURSOR, glfw.CURSOR_HIDDEN)
        glfw.swap_interval(1)
        return window

    @property
    def closed(self) -> bool:
        """Whether Escape was pressed or the window closed."""
        glfw.poll_events()
        pressed = glfw.get_key(self._window, glfw.KEY_ESCAPE) == glfw.PRESS
        return pressed or bool(glfw.window_should_close(self._window))

    def idle(self, seconds: float) -> None:
        """Wait for a time, or less, and let the window answer its display."""
        glfw.poll_events()
        time.sleep(min(seconds, 0.005))

    def prepare(self, codes: Image8) -> None:
        """Draw code values (height, width), row 0 at the top, behind what is shown."""
        self._codes.write(np.ascontiguousarray(codes))
        self._ctx.screen.use()
        self._codes.use(0)
        self._triangle.render(moderngl.TRIANGLES, vertices=3)
        self._ctx.finish()

    def show(self) -> None:
        """Show what was prepared at the screen's next refresh, and wait for that."""
        glfw.swap_buffers(self._window)
        self._ctx.finish()

    def prepared(self) -> Image8:
        """(height, width, 3) what was prepared, read back."""
        width, height = self.size
        pixels = np.frombuffer(self._ctx.screen.read(alignment=1), dtype=np.uint8)
        return pixels.reshape(height, width, 3)[::-1]

    def close(self) -> None:
        """Give the screen back."""
        glfw.terminate()

    def __enter__(self) -> FullScreen:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
