"""Which OpenGL context is current on this thread, how to make it current again, and its functions.

Asked of EGL, GLX and OSMesa, each by its own library. A library that this process has not loaded
can hold nothing current, and is not loaded to ask.
"""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from simgl.errors import ContextError

_POINTER, _INT, _BYTE = ctypes.c_void_p, ctypes.c_int, ctypes.c_ubyte
_XID = ctypes.c_ulong
_EGL_DRAW, _EGL_READ = 0x3059, 0x305A
_UNSIGNED_BYTE = 0x1401


@dataclass(frozen=True)
class Binding:
    """One context as it is current on a thread, with the surfaces that it draws on.

    make_current : the window system's function
    arguments : of the function for this context; ``nothing``: to leave none current
    address_of : where an OpenGL function lies; None where there is none of that name
    """

    make_current: Callable[..., int]
    arguments: tuple[int | None, ...]
    nothing: tuple[int | None, ...]
    address_of: Callable[[bytes], int | None]

    def restore(self) -> bool:
        """Make it current again; False where it is destroyed or current on another thread."""
        return bool(self.make_current(*self.arguments))

    def release(self) -> None:
        """Leave no context of its window system current on this thread."""
        self.make_current(*self.nothing)


# Asks one window system.
_Query = Callable[[], Binding | None]


def _function(library: ctypes.CDLL, name: str, result: Any, *arguments: Any) -> Callable[..., Any]:
    """A C function with its types, whatever others declare for the same one."""
    address = ctypes.cast(getattr(library, name), _POINTER).value
    assert address is not None
    function: Callable[..., Any] = ctypes.CFUNCTYPE(result, *arguments)(address)
    return function


def _egl(library: ctypes.CDLL) -> _Query:
    context = _function(library, "eglGetCurrentContext", _POINTER)
    display = _function(library, "eglGetCurrentDisplay", _POINTER)
    surface = _function(library, "eglGetCurrentSurface", _POINTER, _INT)
    make_current = _function(library, "eglMakeCurrent", ctypes.c_uint, *[_POINTER] * 4)
    address_of = _function(library, "eglGetProcAddress", _POINTER, ctypes.c_char_p)

    def query() -> Binding | None:
        if not (handle := context()):
            return None
        where = display()
        bound = where, surface(_EGL_DRAW), surface(_EGL_READ), handle
        return Binding(make_current, bound, (where, None, None, None), address_of)

    return query


def _glx(library: ctypes.CDLL) -> _Query:
    context = _function(library, "glXGetCurrentContext", _POINTER)
    display = _function(library, "glXGetCurrentDisplay", _POINTER)
    draw = _function(library, "glXGetCurrentDrawable", _XID)
    read = _function(library, "glXGetCurrentReadDrawable", _XID)
    make_current = _function(library, "glXMakeContextCurrent", _INT, _POINTER, _XID, _XID, _POINTER)
    address_of = _function(library, "glXGetProcAddressARB", _POINTER, ctypes.c_char_p)

    def query() -> Binding | None:
        if not (handle := context()):
            return None
        where = display()
        bound = where, draw(), read(), handle
        return Binding(make_current, bound, (where, 0, 0, None), address_of)

    return query


def _osmesa(library: ctypes.CDLL) -> _Query:
    context = _function(library, "OSMesaGetCurrentContext", _POINTER)
    memory = _function(library, "OSMesaGetColorBuffer", _BYTE, *[_POINTER] * 5)
    make_current = _function(
        library, "OSMesaMakeCurrent", _BYTE, _POINTER, _POINTER, _INT, _INT, _INT
    )
    address_of = _function(library, "OSMesaGetProcAddress", _POINTER, ctypes.c_char_p)

    def query() -> Binding | None:
        if not (handle := context()):
            return None
        width, height, kind, pixels = _INT(), _INT(), _INT(), _POINTER()
        memory(handle, *(ctypes.byref(value) for value in (width, height, kind, pixels)))
        bound = handle, pixels.value, _UNSIGNED_BYTE, width.value, height.value
        return Binding(make_current, bound, (None, None, 0, 0, 0), address_of)

    return query


# In the order in which they are asked: Mesa's OSMesa takes a context of EGL for its own.
_SYSTEMS = {"libEGL.so.1": _egl, "libGLX.so.0": _glx, "libOSMesa.so.8": _osmesa}
_queries: dict[str, _Query] = {}


def find_loaded() -> None:
    """Look which window systems' libraries this process has loaded since it was last looked."""
    for name in _SYSTEMS.keys() - _queries.keys():
        try:
            library = ctypes.CDLL(name, mode=os.RTLD_NOLOAD | os.RTLD_LAZY)
        except (OSError, AttributeError):
            # Not loaded, or no Linux.
            continue
        _queries[name] = _SYSTEMS[name](library)


def current_binding() -> Binding | None:
    """The context that is current on this thread, if any."""
    for name in _SYSTEMS:
        query = _queries.get(name)
        binding = None if query is None else query()
        if binding is not None:
            return binding
    return None


def opengl_function(name: str, *arguments: Any) -> Callable[..., None]:
    """A function of the context that is current on this thread, which returns nothing.

    arguments : their types

    Raises ContextError where no context is current, or its driver has no such function.
    """
    binding = current_binding()
    if binding is None:
        # Of a library that was loaded since, such as a window's.
        find_loaded()
        binding = current_binding()
    address = None if binding is None else binding.address_of(name.encode())
    if not address:
        raise ContextError(f"no current OpenGL context has {name}", "run `simgl doctor`")
    function: Callable[..., None] = ctypes.CFUNCTYPE(None, *arguments)(address)
    return function
