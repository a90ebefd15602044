"""The window: GLFW's events replace the view settings, frames follow them."""

from __future__ import annotations

import itertools
import math
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import moderngl

from simgl.cli_progress import activity
from simgl.errors import ConfigError, ContextError, OutputError
from simgl.gpu.context import REQUIRED_VERSION, close_context
from simgl.images import png_bytes
from simgl.output import complete_file
from simgl.scenario.loader import load_scenario
from simgl.viewer.view_settings import COMMANDS, HELP, ViewSettings, opening_settings, title
from simgl.viewer.viewport import Size, Viewport, read_window

_REMEDY = "use simgl render, or run under xvfb-run"

try:
    import glfw
except ImportError as error:
    raise ContextError(f"the GLFW library cannot be loaded ({error})", _REMEDY) from None

WINDOW_SIZE: Size = (960, 640)

# Seconds that an idle window waits for events; short enough for Ctrl-C to be felt.
_IDLE = 0.25
# A window that is being resized shows the old image until its size is stable for this long [s].
_SETTLE = 0.2

BY_KEY = {key: command for command in COMMANDS for key in command.keys}

# Characters arrive as the keyboard layout types them; these keys type no character.
_NAMED_KEYS = {
    glfw.KEY_LEFT: "left",
    glfw.KEY_RIGHT: "right",
    glfw.KEY_UP: "up",
    glfw.KEY_DOWN: "down",
    glfw.KEY_ESCAPE: "escape",
}


class _WindowContext:
    """The context of a GLFW window as moderngl's loader of OpenGL functions.

    It serves every kind of window that GLFW may choose (GLX, EGL under Wayland).
    """

    def __init__(self, window: Any) -> None:
        self._window = window

    def load_opengl_function(self, name: str) -> int:
        address: Any = glfw.get_proc_address(name)
        return address or 0

    def __enter__(self) -> _WindowContext:
        glfw.make_context_current(self._window)
        return self

    def __exit__(self, *_: object) -> None:
        glfw.make_context_current(None)  # type: ignore[arg-type]

    def release(self) -> None:
        """The window owns the context."""


@contextmanager
def _window(caption: str) -> Iterator[Any]:
    """A GLFW window with a current OpenGL 3.3 core context, closed at the end of the block.

    Raises ContextError where there is no display or no such context, and for whatever GLFW reports.
    """
    without = [name for name in ("DISPLAY", "WAYLAND_DISPLAY") if not os.environ.get(name)]
    if sys.platform.startswith("linux") and len(without) == 2:
        raise ContextError("no display: DISPLAY is not set", _REMEDY)
    reporting, glfw.ERROR_REPORTING = glfw.ERROR_REPORTING, "raise"
    try:
        glfw.init()
        glfw.window_hint(glfw.CONTEXT_VERSION_MAJOR, 3)
        glfw.window_hint(glfw.CONTEXT_VERSION_MINOR, 3)
        glfw.window_hint(glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE)
        glfw.window_hint(glfw.OPENGL_FORWARD_COMPAT, True)
        window = glfw.create_window(*WINDOW_SIZE, caption, None, None)
        glfw.make_context_current(window)
        yield window
    except glfw.GLFWError as error:
        # The text of a GLFW error is "(CODE) b'REASON'".
        reason = str(error).partition("b'")[2].rstrip("'")
        raise ContextError(f"no window: {reason or error}", _REMEDY) from None
    finally:
        glfw.terminate()
        glfw.ERROR_REPORTING = reporting


class _Session:
    """One open window."""

    def __init__(
        self, window: Any, ctx: moderngl.Context, viewport: Viewport, settings: ViewSettings
    ) -> None:
        self._window, self._viewport, self._settings = window, viewport, settings
        self._target = ctx.screen
        self._size: Size = glfw.get_framebuffer_size(window)
        self._rendered: tuple[ViewSettings, Size] | None = None
        self._shown: ViewSettings | None = None
        self._exposed = True
        self._resized_at = -math.inf
        self._shown_at = -math.inf
        self._cursor = (0.0, 0.0)
        glfw.set_char_callback(window, self._on_character)
        glfw.set_key_callback(window, self._on_key)
        glfw.set_scroll_callback(window, self._on_scroll)
        glfw.set_cursor_pos_callback(window, self._on_cursor)
        glfw.set_window_refresh_callback(window, self._on_refresh)

    def run(self) -> None:
        """Until the window is closed."""
        before = time.monotonic()
        while not glfw.window_should_close(self._window):
            was_playing = self._settings.playing
            if was_playing:
                glfw.poll_events()
            else:
                glfw.wait_events_timeout(_IDLE)
            now = time.monotonic()
            if was_playing and self._settings.playing:
                self._settings = self._settings.later(now - before)
            before = now
            self._follow_size(now)
            if 0 not in self._size:
                self._draw(now)

    def _follow_size(self, now: float) -> None:
        size = glfw.get_framebuffer_size(self._window)
        if size != self._size:
            self._size, self._resized_at, self._exposed = size, now, True

    def _draw(self, now: float) -> None:
        """Render where the image is out of date, display where anything changed."""
        settled = now - self._resized_at >= _SETTLE
        if settled and self._is_out_of_date():
            self._render()
        if self._settings == self._shown and not self._exposed:
            return
        self._viewport.show(self._settings, self._size, self._target)
        glfw.swap_buffers(self._window)
        interval = now - self._shown_at
        fps = 1.0 / interval if self._settings.playing and 0.0 < interval < 1.0 else None
        glfw.set_window_title(self._window, title(self._settings, fps))
        self._shown, self._shown_at, self._exposed = self._settings, now, False

    def _is_out_of_date(self) -> bool:
        if self._rendered is None:
            return True
        settings, size = self._rendered
        return size != self._size or not settings.same_image(self._settings)

    def _render(self) -> None:
        """Render a new image; where that fails, go back to the settings of the last one."""
        try:
            self._viewport.render(self._settings, self._size)
        except ConfigError as error:
            if self._rendered is None:
                raise
            print(f"simgl: {error}", file=sys.stderr)
            self._settings = replace(self._rendered[0], playing=False)
        self._rendered = self._settings, self._size
        self._exposed = True

    def screenshot(self, path: Path) -> None:
        """Draw, and write the window's framebuffer as PNG."""
        if self._is_out_of_date():
            self._render()
        self._viewport.show(self._settings, self._size, self._target)
        # Read before the buffers are swapped: afterwards the back buffer is undefined.
        image = read_window(self._target, self._size)
        glfw.swap_buffers(self._window)
        with complete_file(path) as temporary:
            temporary.write_bytes(png_bytes(image))

    def _press(self, key: str) -> None:
        if key in BY_KEY:
            self._settings = BY_KEY[key].effect(self._settings, self._viewport.scenario)
        elif key in ("q", "escape"):
            glfw.set_window_should_close(self._window, True)
        elif key == "h":
            print(HELP)
        elif key == "s":
            self._save()

    def _save(self) -> None:
        """A screenshot under the first free name in the working directory."""
        numbers = itertools.count(1)
        path = next(p for n in numbers if not (p := Path(f"simgl_view_{n:03d}.png")).exists())
        try:
            self.screenshot(path)
        except OutputError as error:
            print(f"simgl: {error}", file=sys.stderr)
        else:
            print(path)

    def _on_character(self, _window: Any, codepoint: int) -> None:
        character = chr(codepoint).lower()
        self._press("space" if character == " " else character)

    def _on_key(self, _window: Any, key: int, _scancode: int, action: int, _mods: int) -> None:
        if key in _NAMED_KEYS and action in (glfw.PRESS, glfw.REPEAT):
            self._press(_NAMED_KEYS[key])

    def _on_scroll(self, _window: Any, _right: float, up: float) -> None:
        if self._settings.camera is None:
            self._settings = replace(self._settings, orbit=self._settings.orbit.zoomed(up))

    def _on_cursor(self, window: Any, x: float, y: float) -> None:
        right, down = x - self._cursor[0], y - self._cursor[1]
        self._cursor = x, y
        pressed = glfw.get_mouse_button(window, glfw.MOUSE_BUTTON_LEFT) == glfw.PRESS
        if pressed and self._settings.camera is None:
            # Across the window's height is half a turn.
            angle = math.pi / glfw.get_window_size(window)[1]
            orbit = self._settings.orbit.dragged(angle * right, angle * down)
            self._settings = replace(self._settings, orbit=orbit)

    def _on_refresh(self, _window: Any) -> None:
        self._exposed = True


def run(scenario_path: Path, target: str | None = None, screenshot: Path | None = None) -> None:
    """Open the window on a scenario file and stay until it is closed.

    target : the spacecraft to circle; the first if None
    screenshot : save the first frame here as PNG and return at once

    Raises ConfigError for a scenario or target that cannot be shown, ContextError without display.
    """
    scenario = load_scenario(scenario_path)
    settings = opening_settings(scenario, target)
    with _window(title(settings)) as window:
        functions: Any = _WindowContext(window)
        ctx = moderngl.create_context(context=functions, require=REQUIRED_VERSION)
        try:
            with activity("compiling shaders") as progress:
                viewport = Viewport(ctx, scenario, progress)
            with viewport:
                session = _Session(window, ctx, viewport, settings)
                if screenshot is None:
                    print(HELP)
                    session.run()
                else:
                    session.screenshot(screenshot)
        finally:
            close_context(ctx)
