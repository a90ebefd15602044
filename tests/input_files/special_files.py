"""Files that are no regular ones: reading them blocks, never ends or fails."""

from __future__ import annotations

import os
import signal
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import NoReturn

from tests import patience

# Kind of file to what the refusal says of it.
COMPLAINTS = {
    "endless": "cannot be read (is a device)",
    "pipe": "cannot be read (is a pipe)",
    "socket": "cannot be read (is a socket)",
    "folder": "cannot be read (Is a directory)",
    "process": "does not end after its 0 bytes",
    "huge": "is too large",
    "loop": "cannot be read (Too many levels of symbolic links)",
}


def place(kind: str, path: Path) -> None:
    """Put a special file at a path, in place of the file that is there."""
    path.unlink(missing_ok=True)
    if kind == "endless":
        path.symlink_to("/dev/zero")
    elif kind == "pipe":
        os.mkfifo(path)  # without a writer: opening it blocks
    elif kind == "socket":
        _bind(path)
    elif kind == "folder":
        path.mkdir()
    elif kind == "process":
        path.symlink_to("/proc/self/status")  # of size 0, with content
    elif kind == "huge":
        path.touch()
        os.truncate(path, 1 << 40)  # takes no room on the disk
    else:
        path.symlink_to(path)


@contextmanager
def no_waiting(seconds: float = 20.0) -> Iterator[None]:
    """What is inside fails where it does not end, such as by waiting for a pipe."""

    def fail(_number: int, _frame: FrameType | None) -> NoReturn:
        raise AssertionError("reading does not end")

    before = signal.signal(signal.SIGALRM, fail)
    signal.setitimer(signal.ITIMER_REAL, patience.limit(seconds))
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def _bind(path: Path) -> None:
    """A socket file; the address of a socket holds no more than 108 bytes."""
    folder = os.getcwd()
    os.chdir(path.parent)
    try:
        with socket.socket(socket.AF_UNIX) as listener:
            listener.bind(path.name)
    finally:
        os.chdir(folder)
