"""Opens a window by GLFW, with a context in which a subject is drawn."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import moderngl

from simgl.cli_progress import activity, load
from simgl.errors import ContextError
from simgl.gpu.context import COMPUTE_VERSION, REQUIRED_VERSION, close_context
from simgl.viewer.followed import FollowedPreviews, PreviewSource, preview_source
from simgl.viewer.idle_priority import run_when_idle
from simgl.viewer.subject import Size
from simgl.viewer.view_commands import title
from simgl.viewer.view_settings import opening_settings
from simgl.viewer.viewport import Viewport
from simgl.viewer.window_painter import WindowPainter

_REMEDY = "use simgl render, or run under xvfb-run"

try:
    import glfw

    from simgl.viewer.window_session import WindowSession
except ImportError as error:
    raise ContextError(f"the GLFW library cannot be loaded ({error})", _REMEDY) from None

WINDOW_SIZE: Size = (960, 640)


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
    """A GLFW window with a current OpenGL core context, closed at the end of the block.

    Raises ContextError where there is no display or no such context, and for whatever GLFW reports.
    """
    without = [name for name in ("DISPLAY", "WAYLAND_DISPLAY") if not os.environ.get(name)]
    if sys.platform.startswith("linux") and len(without) == 2:
        raise ContextError("no display: DISPLAY is not set", _REMEDY)
    reporting, glfw.ERROR_REPORTING = glfw.ERROR_REPORTING, "raise"
    try:
        glfw.init()
        glfw.window_hint(glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE)
        glfw.window_hint(glfw.OPENGL_FORWARD_COMPAT, True)
        glfw.window_hint(glfw.SCALE_TO_MONITOR, True)
        try:
            window = _created(caption, COMPUTE_VERSION)
        except glfw.GLFWError:
            window = _created(caption, REQUIRED_VERSION)
        glfw.make_context_current(window)
        yield window
    except glfw.GLFWError as error:
        # The text of a GLFW error is "(CODE) b'REASON'".
        reason = str(error).partition("b'")[2].rstrip("'")
        raise ContextError(f"no window: {reason or error}", _REMEDY) from None
    finally:
        glfw.terminate()
        glfw.ERROR_REPORTING = reporting


def _created(caption: str, version: int) -> Any:
    """A window with a context of at least a version, such as 330; drivers may give just that."""
    glfw.window_hint(glfw.CONTEXT_VERSION_MAJOR, version // 100)
    glfw.window_hint(glfw.CONTEXT_VERSION_MINOR, version // 10 % 10)
    return glfw.create_window(*WINDOW_SIZE, caption, None, None)


@contextmanager
def _window_with_context(caption: str) -> Iterator[tuple[Any, moderngl.Context]]:
    with _window(caption) as window:
        functions: Any = _WindowContext(window)
        ctx = moderngl.create_context(context=functions, require=REQUIRED_VERSION)
        try:
            yield window, ctx
        finally:
            close_context(ctx)


@contextmanager
def opened(
    scenario_path: Path, target: str | None = None, camera: str | None = None
) -> Iterator[WindowSession]:
    """A window on a scenario file.

    target : the spacecraft to circle; the first if None
    camera : to look through at first; the orbit camera if None

    Raises ConfigError for what cannot be shown, ContextError without a display.
    """
    scenario = load(scenario_path)
    settings = opening_settings(scenario, target, camera)
    with _window_with_context(title(settings)) as (window, ctx):
        with activity("compiling shaders") as progress:
            viewport = Viewport(ctx, scenario, settings, progress)
        with viewport, WindowPainter(ctx) as painter:
            yield WindowSession(window, ctx, viewport, painter)


@contextmanager
def opened_on_server(address: str, source: PreviewSource) -> Iterator[WindowSession]:
    """A window on the previews of a running server.

    Raises ContextError without a display.
    """
    subject = FollowedPreviews(address, source)
    with (
        _window_with_context(subject.caption(None)) as (window, ctx),
        WindowPainter(ctx) as painter,
    ):
        yield WindowSession(window, ctx, subject, painter)


def follow(address: str) -> None:
    """Show a running server's previews until the window is closed; see ``opened_on_server``.

    Raises ConfigError where the bridge is not installed, BridgeError for what is not an address.
    """
    source = preview_source(address)
    run_when_idle()
    try:
        with opened_on_server(address, source) as session:
            session.run()
    finally:
        source.close()


def run(
    scenario_path: Path,
    target: str | None = None,
    screenshot: Path | None = None,
    camera: str | None = None,
) -> None:
    """Open the window and stay until it is closed; see ``opened``.

    screenshot : save the first image here as PNG, without text, and return at once
    """
    with opened(scenario_path, target, camera) as session:
        if screenshot is None:
            session.run()
        else:
            session.screenshot(screenshot)
