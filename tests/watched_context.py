"""An OpenGL context that knows which objects were made in it and not yet deleted."""

from __future__ import annotations

import ctypes
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import moderngl

from simgl.gpu.context import current, open_context, preserve_current
from simgl.gpu.pipeline_state import State
from simgl.gpu.window_systems import current_binding

_GENERATED = (
    "Texture", "Buffer", "Framebuffer", "Renderbuffer", "VertexArray", "Query", "Sampler"
)  # fmt: skip
_CREATED = ("Program", "Shader")
_GENERATE = ctypes.CFUNCTYPE(None, ctypes.c_int, ctypes.POINTER(ctypes.c_uint))
_CREATE = {
    "Program": ctypes.CFUNCTYPE(ctypes.c_uint),
    "Shader": ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_uint),
}
_DELETE = ctypes.CFUNCTYPE(None, ctypes.c_uint)
_GET_STRING = ctypes.CFUNCTYPE(ctypes.c_char_p, ctypes.c_uint)
_GL_VENDOR = 0x1F00


def hide_draws(ctx: moderngl.Context) -> None:
    """Set a state in which nothing is drawn, until ``State.apply`` sets another one."""
    nothing = State(cull="back", blend=(moderngl.ZERO, moderngl.ZERO), clip_planes=4)
    nothing.apply(ctx, ctx.detect_framebuffer(0), (0, 0, 1, 1))
    ctx.cull_face = "front_and_back"


class WatchedContext:
    """A headless context whose functions that make and delete objects keep a list of them.

    Asking OpenGL itself (glIsTexture, ...) would need the names, and drivers need not use a name
    again: those of a long session have no bound.

    ctx : for moderngl
    living : how many objects of each kind there are
    """

    def __init__(self) -> None:
        with preserve_current():
            self._opened = open_context()
            self._binding = current_binding()
            mglo: Any = self._opened.mglo
            self._functions = mglo._context
            self._hooks: dict[str, Any] = {}
            self._names: dict[str, set[int]] = {kind: set() for kind in (*_GENERATED, *_CREATED)}
            self._counts = True
            for kind in _GENERATED:
                plural = "Queries" if kind == "Query" else f"{kind}s"
                self._watch_generated(kind, f"glGen{plural}", f"glDelete{plural}")
            for kind in _CREATED:
                self._watch_created(kind, f"glCreate{kind}", f"glDelete{kind}")
            itself: Any = self
            self.ctx = moderngl.create_context(context=itself)
        self._get_string = _GET_STRING(self._functions.load_opengl_function("glGetString"))

    def check(self) -> None:
        """Fails where a call left an error flag behind, or where calls do not reach OpenGL."""
        with current(self.ctx):
            # Without a context there is no error either.
            assert self._get_string(_GL_VENDOR), "no context is current"
            error = self.ctx.error
            assert error == "GL_NO_ERROR", error

    @property
    def living(self) -> Counter[str]:
        """How many objects of each kind were made and not deleted."""
        return Counter({kind: len(names) for kind, names in self._names.items()})

    @contextmanager
    def not_counted(self) -> Iterator[None]:
        """What is made inside lives as long as the context and is none of ``living``."""
        self._counts = False
        try:
            yield
        finally:
            self._counts = True

    def _is_current(self) -> bool:
        # Nothing is made or deleted while another context is current, or none.
        return current_binding() == self._binding

    def _watch_generated(self, kind: str, make: str, delete: str) -> None:
        really_make = _GENERATE(self._functions.load_opengl_function(make))
        really_delete = _GENERATE(self._functions.load_opengl_function(delete))

        def on_make(count: int, names: Any) -> None:
            really_make(count, names)
            if self._counts and self._is_current():
                self._names[kind].update(names[:count])

        def on_delete(count: int, names: Any) -> None:
            really_delete(count, names)
            if self._is_current():
                self._names[kind].difference_update(names[:count])

        self._hooks |= {make: _GENERATE(on_make), delete: _GENERATE(on_delete)}

    def _watch_created(self, kind: str, make: str, delete: str) -> None:
        really_make = _CREATE[kind](self._functions.load_opengl_function(make))
        really_delete = _DELETE(self._functions.load_opengl_function(delete))

        def on_make(*arguments: int) -> int:
            name = int(really_make(*arguments))
            if self._counts and self._is_current():
                self._names[kind].add(name)
            return name

        def on_delete(name: int) -> None:
            really_delete(name)
            if self._is_current():
                self._names[kind].discard(name)

        self._hooks |= {make: _CREATE[kind](on_make), delete: _DELETE(on_delete)}

    # What moderngl asks of a context.

    def load_opengl_function(self, name: str) -> int:
        """Address of an OpenGL function, or of the hook that watches it."""
        if name in self._hooks:
            return ctypes.cast(self._hooks[name], ctypes.c_void_p).value or 0
        return int(self._functions.load_opengl_function(name))

    def __enter__(self) -> WatchedContext:
        self._functions.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        self._functions.__exit__(None, None, None)

    def release(self) -> None:
        """Destroy the context."""
        self._opened.release()
