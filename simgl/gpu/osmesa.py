"""An OpenGL context from libOSMesa, for machines without EGL; moderngl takes it as ``context=``."""

from __future__ import annotations

import ctypes
import ctypes.util

from simgl.errors import ContextError

# Values of GL/osmesa.h.
_FORMAT, _RGBA = 0x22, 0x1908
_DEPTH_BITS = 0x30
_PROFILE, _CORE_PROFILE = 0x33, 0x34
_MAJOR, _MINOR = 0x36, 0x37
_UNSIGNED_BYTE = 0x1401


class OSMesaContext:
    """An off-screen context of at least OpenGL 3.3 core, current from construction on."""

    def __init__(self) -> None:
        name = ctypes.util.find_library("OSMesa") or "libOSMesa.so.8"
        try:
            self._library = ctypes.CDLL(name)
        except OSError as error:
            raise ContextError(
                f"libOSMesa cannot be loaded ({error})", "apt-get install libosmesa6"
            ) from None
        self._library.OSMesaCreateContextAttribs.restype = ctypes.c_void_p
        self._library.OSMesaCreateContextAttribs.argtypes = [ctypes.c_void_p, ctypes.c_void_p]
        self._library.OSMesaGetProcAddress.restype = ctypes.c_void_p
        self._library.OSMesaGetProcAddress.argtypes = [ctypes.c_char_p]
        self._library.OSMesaMakeCurrent.argtypes = [ctypes.c_void_p, ctypes.c_void_p] + [
            ctypes.c_int
        ] * 3
        self._library.OSMesaDestroyContext.argtypes = [ctypes.c_void_p]
        wanted = [_FORMAT, _RGBA, _DEPTH_BITS, 24, _PROFILE, _CORE_PROFILE, _MAJOR, 3, _MINOR, 3, 0]
        attributes = (ctypes.c_int * len(wanted))(*wanted)
        self._context = self._library.OSMesaCreateContextAttribs(attributes, None)
        if not self._context:
            raise ContextError(
                "libOSMesa offers no OpenGL 3.3 core, its version is too low",
                "install Mesa 20 or newer",
            )
        # OSMesa needs a window buffer even if every image goes to a framebuffer object.
        self._pixels = (ctypes.c_ubyte * (4 * 4 * 4))()
        self.__enter__()

    def load_opengl_function(self, name: str) -> int:
        """Address of an OpenGL function; 0 where it does not exist."""
        return self._library.OSMesaGetProcAddress(name.encode()) or 0

    def __enter__(self) -> OSMesaContext:
        made = self._library.OSMesaMakeCurrent(self._context, self._pixels, _UNSIGNED_BYTE, 4, 4)
        if not made:
            raise ContextError("libOSMesa cannot make its context current", "reinstall libosmesa6")
        return self

    def __exit__(self, *_: object) -> None:
        """No context is current; ``simgl.gpu.context.current`` restores the one before."""
        self._library.OSMesaMakeCurrent(None, None, _UNSIGNED_BYTE, 0, 0)

    def release(self) -> None:
        """Destroy the context."""
        if self._context:
            self._library.OSMesaDestroyContext(self._context)
            self._context = None
