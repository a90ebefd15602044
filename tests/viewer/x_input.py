"""Real keys, mouse and resizing for windows of an X server, by its XTEST extension."""

from __future__ import annotations

import ctypes
import ctypes.util
import time
from typing import Any

import pytest

_NAMES = {" ": "space", "+": "plus", "-": "minus", "[": "bracketleft", "]": "bracketright"}


def _library(name: str) -> Any:
    found = ctypes.util.find_library(name)
    if found is None:
        pytest.skip(f"lib{name} is not installed (apt-get install lib{name.lower()}6)")
    return ctypes.CDLL(found)


class XInput:
    """A person before an X server.

    display : name of the server, such as ":99"
    dots_per_inch : that its desktop tells programs, 96 for a content scale of 1
    """

    def __init__(self, display: str, dots_per_inch: int = 96) -> None:
        self._x, self._test = _library("X11"), _library("Xtst")
        self._x.XOpenDisplay.restype = ctypes.c_void_p
        self._x.XDefaultRootWindow.restype = ctypes.c_ulong
        self._x.XStringToKeysym.restype = ctypes.c_ulong
        self._display = ctypes.c_void_p(self._x.XOpenDisplay(display.encode()))
        assert self._display.value, display
        self._root = ctypes.c_ulong(self._x.XDefaultRootWindow(self._display))
        resources = f"Xft.dpi:\t{dots_per_inch}\n".encode()
        # RESOURCE_MANAGER is atom 23, STRING 31: predefined by the protocol.
        self._x.XChangeProperty(
            self._display, self._root, ctypes.c_ulong(23), ctypes.c_ulong(31), 8, 0, resources,
            len(resources),
        )  # fmt: skip
        self._sync()

    def _sync(self) -> None:
        self._x.XSync(self._display, 0)

    def key(self, *names: str) -> None:
        """Press and release keys: characters, or names of X such as "Up"."""
        for name in names:
            keysym = self._x.XStringToKeysym(_NAMES.get(name, name).encode())
            code = self._x.XKeysymToKeycode(self._display, ctypes.c_ulong(keysym))
            assert code, name
            shift = self._x.XKeysymToKeycode(
                self._display, ctypes.c_ulong(self._x.XStringToKeysym(b"Shift_L"))
            )
            pressed = [shift, code] if name == "+" else [code]
            for down in pressed:
                self._test.XTestFakeKeyEvent(self._display, down, 1, ctypes.c_ulong(0))
            for up in reversed(pressed):
                self._test.XTestFakeKeyEvent(self._display, up, 0, ctypes.c_ulong(0))
            self._sync()
            # GLFW takes two presses of one key within a millisecond for one.
            time.sleep(0.02)

    def move(self, x: int, y: int) -> None:
        """The mouse to a place on the screen [px]."""
        self._test.XTestFakeMotionEvent(self._display, -1, x, y, ctypes.c_ulong(0))
        self._sync()

    def button(self, number: int, down: bool) -> None:
        """Press or release a button of the mouse; 4 and 5 are the wheel."""
        self._test.XTestFakeButtonEvent(self._display, number, int(down), ctypes.c_ulong(0))
        self._sync()

    def drag(self, start: tuple[int, int], end: tuple[int, int]) -> None:
        """With the left button."""
        self.move(*start)
        self.button(1, True)
        # A person's hand takes its time; the press must be seen before the motion.
        time.sleep(0.1)
        self.move(*end)
        time.sleep(0.1)
        self.button(1, False)

    def scroll(self, away: bool) -> None:
        """Turn the wheel by one step."""
        number = 4 if away else 5
        self.button(number, True)
        self.button(number, False)

    def resize(self, width: int, height: int) -> None:
        """The window that covers the most, as somebody who drags its corner."""
        window = max(self._windows(), key=lambda w: w[1] * w[2])[0]
        self._x.XResizeWindow(self._display, ctypes.c_ulong(window), width, height)
        self._sync()

    def _windows(self) -> list[tuple[int, int, int]]:
        """Numbers, widths and heights of the windows."""
        root, parent, count = ctypes.c_ulong(), ctypes.c_ulong(), ctypes.c_uint()
        children = ctypes.POINTER(ctypes.c_ulong)()
        self._x.XQueryTree(
            self._display, self._root, ctypes.byref(root), ctypes.byref(parent),
            ctypes.byref(children), ctypes.byref(count),
        )  # fmt: skip
        found = []
        for window in children[: count.value]:
            x, y = ctypes.c_int(), ctypes.c_int()
            sizes = [ctypes.c_uint() for _ in range(4)]
            self._x.XGetGeometry(
                self._display, ctypes.c_ulong(window), ctypes.byref(root), ctypes.byref(x),
                ctypes.byref(y), *(ctypes.byref(size) for size in sizes),
            )  # fmt: skip
            found.append((window, sizes[0].value, sizes[1].value))
        return found

    def close(self) -> None:
        """Leave."""
        self._x.XCloseDisplay(self._display)
