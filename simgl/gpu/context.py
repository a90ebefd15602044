"""OpenGL contexts: headless ones (EGL, else OSMesa), and which one is current.

moderngl's own ``with ctx:`` leaves no context current, or another one, where it is nested; use
``with current(ctx):``, which restores what was current before.
"""

from __future__ import annotations

import ctypes
import ctypes.util
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

import moderngl

from simgl.errors import ContextError
from simgl.gpu.driver_cache import protect_driver_cache
from simgl.gpu.held_signals import signals_held
from simgl.gpu.osmesa import OSMesaContext
from simgl.gpu.window_systems import Binding, current_binding, find_loaded, opengl_function

REQUIRED_VERSION = 330
# From which on there are compute shaders.
COMPUTE_VERSION = 430
BACKENDS = ("auto", "egl", "osmesa")


@dataclass(frozen=True)
class GlReport:
    """What an open context is."""

    backend: str
    vendor: str
    renderer: str
    version: str
    software: bool


def _library(name: str, fallback: str) -> ctypes.CDLL | None:
    try:
        return ctypes.CDLL(ctypes.util.find_library(name) or fallback)
    except OSError:
        return None


def egl_device_count() -> int | None:
    """Number of EGL devices; None where libEGL or its device query is missing."""
    egl = _library("EGL", "libEGL.so.1")
    if egl is None:
        return None
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    egl.eglGetProcAddress.argtypes = [ctypes.c_char_p]
    address = egl.eglGetProcAddress(b"eglQueryDevicesEXT")
    if not address:
        return None
    pointer = ctypes.POINTER(ctypes.c_int)
    query = ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_int, ctypes.c_void_p, pointer)(address)
    count = ctypes.c_int(0)
    return count.value if query(0, None, ctypes.byref(count)) else 0


def _why_egl_fails(device_index: int, error: Exception) -> ContextError:
    """The reason why EGL gave no context, found by looking at each thing that it needs."""
    if _library("EGL", "libEGL.so.1") is None:
        return ContextError("libEGL.so.1 is missing", "apt-get install libegl1")
    if _library("GL", "libGL.so.1") is None:
        return ContextError("libGL.so.1 is missing", "apt-get install libgl1")
    devices = egl_device_count()
    if not devices:
        return ContextError(
            "EGL knows no vendor (no file in glvnd/egl_vendor.d) or no device",
            "apt-get install libegl-mesa0, or install the GPU driver's EGL library",
        )
    if not 0 <= device_index < devices:
        return ContextError(
            f"EGL device {device_index} does not exist, there are {devices} (0..{devices - 1})",
            f"choose one of 0..{devices - 1} by SIMGL_DEVICE",
        )
    text = str(error)
    # EGL initialises before it looks at versions: a context refused later is one too old.
    if "eglCreateContext" in text or "version" in text.lower():
        return ContextError(
            f"EGL device {device_index} offers no OpenGL 3.3 core, its version is too low ({text})",
            "LIBGL_ALWAYS_SOFTWARE=1 selects Mesa's llvmpipe, which offers 4.5",
        )
    return ContextError(
        f"EGL device {device_index} has no working driver ({text})",
        "apt-get install libgl1-mesa-dri (the DRI drivers), or repair the GPU driver",
    )


def _open_egl(device_index: int) -> moderngl.Context:
    devices = egl_device_count()
    if devices and not 0 <= device_index < devices:
        raise _why_egl_fails(device_index, ValueError("no such device"))
    options: dict[str, Any] = {"backend": "egl", "device_index": device_index}
    # Some drivers give no more than is asked for.
    with suppress(Exception):
        return moderngl.create_context(standalone=True, require=COMPUTE_VERSION, **options)
    try:
        return moderngl.create_context(standalone=True, require=REQUIRED_VERSION, **options)
    except Exception as error:
        raise _why_egl_fails(device_index, error) from None


def _open_osmesa() -> moderngl.Context:
    functions: Any = OSMesaContext()
    try:
        return moderngl.create_context(context=functions, require=REQUIRED_VERSION)
    except BaseException:
        functions.release()
        raise


def _device_from_environment() -> int:
    value = os.environ.get("SIMGL_DEVICE", "0")
    if not value.isdecimal():
        raise ContextError(f'SIMGL_DEVICE is not a device index: "{value}"', "set it to 0, 1, ...")
    return int(value)


def open_context(backend: str = "auto", device_index: int = 0) -> moderngl.Context:
    """A headless context of at least OpenGL 3.3, current on this thread until another one is.

    backend : "auto", "egl" or "osmesa"; SIMGL_BACKEND sets what "auto" means
    device_index : of the EGL device; SIMGL_DEVICE sets the default

    Raises ContextError with the reason and the command that fixes it.
    """
    protect_driver_cache()
    find_loaded()
    before = current_binding()
    if before is not None:
        # No window system takes a thread over from another one.
        before.release()
    try:
        # OSMesa's functions are looked up by Python.
        with signals_held():
            ctx = _open(backend, device_index)
    except ContextError:
        _restore(before)
        raise
    find_loaded()
    binding = current_binding()
    if binding is not None:
        _bindings[ctx] = binding
    return ctx


def _open(backend: str, device_index: int) -> moderngl.Context:
    if backend == "auto":
        backend = os.environ.get("SIMGL_BACKEND", "auto")
        device_index = device_index or _device_from_environment()
    if backend not in BACKENDS:
        raise ContextError(f'no backend "{backend}"', f"choose one of {', '.join(BACKENDS)}")
    if backend == "egl":
        return _open_egl(device_index)
    if backend == "osmesa":
        return _open_osmesa()
    try:
        return _open_egl(device_index)
    except ContextError as egl_error:
        # A device that was asked for by number is not replaced by another renderer in silence.
        if device_index:
            raise
        try:
            return _open_osmesa()
        except ContextError:
            raise egl_error from None


# How each context is current when it is.
_bindings: WeakKeyDictionary[moderngl.Context, Binding] = WeakKeyDictionary()


def _restore(binding: Binding | None) -> None:
    """Make a former context, or none, current in place of the present one."""
    now = current_binding()
    if now == binding:
        return
    if now is not None:
        now.release()
    if binding is not None:
        binding.restore()


def _enter(ctx: moderngl.Context, before: Binding | None) -> None:
    """Make a context current in place of the former one."""
    if before is not None:
        before.release()
    known = _bindings.get(ctx)
    if known is not None and known.restore():
        return
    ctx.mglo.__enter__()
    now = current_binding()
    if now is None and known is None and before is not None:
        # Entering a context of the user's own may do nothing: it is the one that was current.
        before.restore()
        now = before
    if now is not None:
        _bindings[ctx] = now
    elif known is not None:
        raise ContextError(
            "the OpenGL context is current on another thread",
            "use it on one thread, or open it there inside `with preserve_current():`",
        )


@contextmanager
def current(ctx: moderngl.Context) -> Iterator[moderngl.Context]:
    """A context is current on this thread; at the end that is again which was so before.

    It may be nested, and contexts of several threads and window systems may take turns.

    Raises ContextError where the context is current on another thread, or is closed.
    """
    if is_closed(ctx):
        raise ContextError("the OpenGL context is closed", "open another one, or a new Simulator")
    if ctx not in _bindings:
        find_loaded()
    before = current_binding()
    if before is not None and before == _bindings.get(ctx):
        yield ctx
        return
    try:
        _enter(ctx, before)
        yield ctx
    finally:
        if ctx not in _bindings:
            # Of a window system that cannot be asked.
            ctx.mglo.__exit__(None, None, None)
        _restore(before)


@contextmanager
def preserve_current() -> Iterator[None]:
    """Whatever opens or enters contexts inside, the one that was current is so again at the end."""
    before = current_binding()
    try:
        yield
    finally:
        _restore(before)


def is_closed(ctx: moderngl.Context) -> bool:
    """Whether a context was destroyed."""
    return isinstance(ctx.mglo, moderngl.InvalidObject)


def close_context(ctx: moderngl.Context) -> None:
    """Destroy a context, on its thread; what is left needs no garbage collector.

    That might run on another thread. moderngl's context and its framebuffers refer to each other.
    """
    ctx.release()
    closed: Any = ctx
    closed.fbo = closed._screen = None


@contextmanager
def temporary_context(backend: str = "auto", device_index: int = 0) -> Iterator[moderngl.Context]:
    """A context as ``open_context`` makes it, released at the end; what was current is so again."""
    with preserve_current():
        ctx = open_context(backend, device_index)
        try:
            with current(ctx):
                yield ctx
        finally:
            close_context(ctx)


_functions: WeakKeyDictionary[moderngl.Context, dict[str, Callable[[], None]]] = WeakKeyDictionary()


def _call(ctx: moderngl.Context, name: str) -> None:
    """Call a function of OpenGL without arguments, while other threads run."""
    known = _functions.setdefault(ctx, {})
    if name not in known:
        known[name] = opengl_function(name)
    known[name]()


def wait_for_draws(ctx: moderngl.Context) -> None:
    """Wait until all is drawn, while other threads run.

    To be called before what is drawn is read: moderngl's reads keep Python's lock while they wait.
    """
    _call(ctx, "glFinish")


def begin_draws(ctx: moderngl.Context) -> None:
    """Let the driver draw what it was given, while this thread prepares what comes next.

    llvmpipe gathers draws until their target changes, and its threads have nothing to do meanwhile.
    Draws to parts of one target are better left together: each beginning takes it as long as a
    small draw.
    """
    _call(ctx, "glFlush")


def is_software(ctx: moderngl.Context) -> bool:
    """Whether the renderer runs on the CPU."""
    return is_software_name(ctx.info["GL_RENDERER"])


def is_software_name(renderer: str) -> bool:
    """The same, by the renderer's name."""
    return any(word in renderer.lower() for word in ("llvmpipe", "softpipe", "swrast", "software"))


def prefers_compute(ctx: moderngl.Context) -> bool:
    """Whether full-screen work is done by compute shaders rather than by fragment shaders.

    A data-centre GPU shades fragments with few of its units: an NVIDIA H200 takes 20 to 33 times
    as long for the same work. No other GPU is known that is faster with fragments; a CPU renderer
    is, 4 to 9 times.
    """
    return ctx.version_code >= COMPUTE_VERSION and not is_software(ctx)


def report(ctx: moderngl.Context, backend: str) -> GlReport:
    """What the context is."""
    return GlReport(
        backend=backend,
        vendor=ctx.info["GL_VENDOR"],
        renderer=ctx.info["GL_RENDERER"],
        version=ctx.info["GL_VERSION"],
        software=is_software(ctx),
    )
