"""The one way to read a file that a user names: regular files only, up to a size.

What is read inside ``recorded_inputs`` is recorded there, by its content.
"""

from __future__ import annotations

import hashlib
import os
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from simgl.errors import AssetError

# Scenarios, presets, cards, curves and keys are written by hand or by small programs.
MAX_TEXT_BYTES = 4 << 20
# Meshes, images and tables of motion.
MAX_DATA_BYTES = 1 << 30

# Of each open ``recorded_inputs``, the outermost first.
_records: ContextVar[tuple[dict[Path, str], ...]] = ContextVar("records", default=())

_KINDS = {
    stat.S_IFDIR: "Is a directory",
    stat.S_IFCHR: "is a device",
    stat.S_IFBLK: "is a device",
    stat.S_IFIFO: "is a pipe",
    stat.S_IFSOCK: "is a socket",
}


def read_file(path: Path, max_bytes: int = MAX_DATA_BYTES) -> bytes:
    """The bytes of a regular file; links are followed.

    A pipe, a device or a file of /proc could block for ever or never end, so none is read.

    Raises AssetError, which starts with the path, for a file that is missing, unreadable, of
    another kind or larger than ``max_bytes``, or that changes while it is read.
    """
    content = _content(path, max_bytes)
    if _records.get():
        record_inputs({path: hashlib.sha256(content).hexdigest()})
    return content


def digest_of(path: Path) -> str:
    """SHA-256 of a file's content, as ``recorded_inputs`` gives it; raises AssetError likewise."""
    return hashlib.sha256(_content(path, MAX_DATA_BYTES)).hexdigest()


def _content(path: Path, max_bytes: int) -> bytes:
    try:
        _check_kind(path, os.stat(path))  # before opening, which may act on a device
        with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as file:
            status = os.fstat(file.fileno())
            _check_kind(path, status)
            size = status.st_size
            if size > max_bytes:
                problem = f"is too large, {_shown(size)}; at most {_shown(max_bytes)} are read"
                raise AssetError(f"{path}: {problem}")
            content = file.read(size + 1)
    except OSError as error:
        raise AssetError(f"{path}: cannot be read ({error.strerror})") from None
    except ValueError as error:  # a path with a zero byte, or with half a character
        raise AssetError(f"{str(path)!r}: cannot be read ({error})") from None
    if len(content) != size:
        problem = f"does not end after its {size} bytes; is it a file that is being written?"
        raise AssetError(f"{path}: {problem}")
    return content


@contextmanager
def recorded_inputs() -> Iterator[dict[Path, str]]:
    """The files that ``read_file`` reads inside, in that order: path to SHA-256 of the content.

    It may be nested; an outer record also has what an inner one has.
    """
    inputs: dict[Path, str] = {}
    token = _records.set((*_records.get(), inputs))
    try:
        yield inputs
    finally:
        _records.reset(token)


def record_inputs(inputs: Mapping[Path, str]) -> None:
    """Add files, with the SHA-256 of their content, to every open record.

    Raises AssetError for a file that was read before, with another content.
    """
    for record in _records.get():
        for path, digest in inputs.items():
            if record.setdefault(path, digest) != digest:
                raise AssetError(f"{path}: has changed while it was in use; start again")


def _check_kind(path: Path, status: os.stat_result) -> None:
    if not stat.S_ISREG(status.st_mode):
        kind = _KINDS.get(stat.S_IFMT(status.st_mode), "is not a regular file")
        raise AssetError(f"{path}: cannot be read ({kind})")


def _shown(size: int) -> str:
    """A size in the largest unit that shows it exactly."""
    for unit, name in ((1 << 30, "GiB"), (1 << 20, "MiB")):
        if size % unit == 0 and size:
            return f"{size // unit} {name}"
    return f"{size} bytes"
