"""Signals that wait while C code calls Python back and cannot take an error from it.

Python handles a signal before the next step of Python code on its main thread, wherever that is.
moderngl has functions of Python describe each uniform of a new program, and uses what they return
unseen: a Ctrl-C that came while a shader was compiled would end the process with a fault.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

# Those that a program may turn into an error.
_HELD = (
    signal.SIGINT,
    signal.SIGTERM,
    signal.SIGHUP,
    signal.SIGQUIT,
    signal.SIGALRM,
    signal.SIGUSR1,
    signal.SIGUSR2,
)


@contextmanager
def signals_held() -> Iterator[None]:
    """Signals that come inside are handled at the end."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []

    def note(number: int, _: FrameType | None) -> None:
        came.append(number)

    held: dict[signal.Signals, Callable[[int, FrameType | None], object]] = {}
    try:
        for number in _HELD:
            handler = signal.getsignal(number)
            if callable(handler):
                held[number] = handler
                signal.signal(number, note)
        yield
    finally:
        for number, handler in held.items():
            signal.signal(number, handler)
        for one in came:
            signal.raise_signal(one)
