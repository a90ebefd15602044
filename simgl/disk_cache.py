"""Arrays cached as files in the user's cache folder."""

from __future__ import annotations

import fcntl
import logging
import os
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from importlib import metadata
from pathlib import Path
from time import monotonic, sleep
from typing import Any, TypeVar

import numpy as np

from simgl.arrays import AnyArray
from simgl.content_digest import content_digest
from simgl.decoded_files import arrays_in
from simgl.errors import AssetError
from simgl.input_files import read_file

# Of each folder: an arm on the move leaves a file with every step.
MAX_BYTES = 1 << 30

# What one waits at most for another process that makes a file, and how often it looks [s].
LONGEST_WAIT_S = 120.0
_LOOK_EVERY_S = 0.05

Arrays = dict[str, AnyArray]

_Made = TypeVar("_Made")

_LOG = logging.getLogger(__name__)


def cache_folder(name: str) -> Path:
    """``$XDG_CACHE_HOME/simgl/NAME``, or the same under ``~/.cache``.

    For a user without a home folder, such as a number that a container runs as, it is one that
    cannot be made.
    """
    base = os.environ.get("XDG_CACHE_HOME")
    try:
        folder = Path(base) if base else Path.home() / ".cache"
    except RuntimeError:
        folder = Path(os.devnull)
    return folder / "simgl" / name


def read_arrays(path: Path) -> Arrays | None:
    """The arrays of a file; None if it is missing, or damaged (each array has a checksum)."""
    try:
        arrays = arrays_in(read_file(path))
    except (AssetError, ValueError):
        return None
    with suppress(OSError):
        os.utime(path)  # the date of its last use, for `_make_room`
    return arrays


def write_arrays(path: Path, arrays: Mapping[str, Any], consequence: str) -> None:
    """Write arrays to a temporary file and rename it, so that readers never see half a file.

    consequence : of a folder that cannot be written, for the log: a warning, not an error
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".part", delete=False) as part:
            temporary = Path(part.name)
            try:
                np.savez(part, **arrays)
                part.flush()
            except BaseException:
                temporary.unlink()
                raise
        temporary.replace(path)
        _make_room(path)
    except OSError as error:
        _warn_once(path.parent, error.strerror, consequence)


@cache
def _warn_once(folder: Path, problem: str | None, consequence: str) -> None:
    """The first time in a process: a folder that takes no file takes none of the next ones."""
    _LOG.warning("%s: %s; %s", folder, problem, consequence)


def _make_room(newest: Path) -> None:
    """Remove the files of a folder that were not used for longest, down to ``MAX_BYTES``."""
    files = []
    for path in newest.parent.iterdir():
        # Another process may remove it meanwhile.
        with suppress(FileNotFoundError):
            status = path.stat()
            files.append((status.st_mtime_ns, status.st_size, path))
    total = sum(size for _, size, _ in files)
    for _, size, path in sorted(files):
        if total <= MAX_BYTES:
            return
        if path != newest:
            path.unlink(missing_ok=True)
            total -= size


def is_computed(folder: str, made_by: Sequence[str], inputs: object) -> bool:
    """Whether there is a file of ``computed_once``; it is not read."""
    return _path(folder, made_by, inputs).is_file()


def computed_once(
    folder: str,
    made_by: Sequence[str],
    inputs: object,
    compute: Callable[[], Arrays],
    fits: Callable[[Arrays], bool] = bool,
) -> Arrays:
    """Arrays that are computed once on a machine, from a file after the first time.

    folder : of the file, below the cache folder
    made_by : names of the modules that compute them, as far as the arrays depend on their source,
        and of packages, as far as they depend on their version: another one computes them again
    inputs : all else that they depend on, for ``content_digest``
    fits : whether arrays are such as ``compute`` returns; others are computed again, also where it
        raises KeyError or ValueError
    """
    path = _path(folder, made_by, inputs)
    return arrays_once(path, compute, fits, "its contents are computed again next time")


def arrays_once(
    path: Path, compute: Callable[[], Arrays], fits: Callable[[Arrays], bool], consequence: str
) -> Arrays:
    """Arrays from a file, computed where it is missing, damaged or does not fit.

    consequence : as for ``write_arrays``
    """

    def read() -> Arrays | None:
        arrays = read_arrays(path)
        return arrays if arrays is not None and _fit(arrays, fits) else None

    def make() -> Arrays:
        arrays = compute()
        write_arrays(path, arrays, consequence)
        return arrays

    return made_once(path, read, make)


def made_once(path: Path, read: Callable[[], _Made | None], make: Callable[[], _Made]) -> _Made:
    """What a file holds; the file is made first if it is missing. Of several processes or threads
    that lack it at the same time one makes it, and the others wait.

    read : returns None while the file is missing or unusable
    make : makes and writes it
    """
    content = read()
    if content is None:
        with _lock_of(path):
            content = read()
            if content is None:
                content = make()
    return content


@contextmanager
def _lock_of(path: Path) -> Iterator[None]:
    """The right to make a file. It ends with the process that has it.

    Without it after ``LONGEST_WAIT_S``, or where the folder takes no lock, the block runs all the
    same: then a file is made twice, which costs only time.
    """
    lock = path.with_suffix(".lock")
    descriptor = _opened(lock)
    if descriptor is None:
        yield
        return
    locked = False
    try:
        locked = _wait_for_lock(descriptor)
        yield
    finally:
        if locked:
            with suppress(OSError):
                lock.unlink()
        os.close(descriptor)


def _opened(lock: Path) -> int | None:
    try:
        lock.parent.mkdir(parents=True, exist_ok=True)
        return os.open(lock, os.O_RDWR | os.O_CREAT, 0o666)
    except OSError:
        return None


def _wait_for_lock(descriptor: int) -> bool:
    end = monotonic() + LONGEST_WAIT_S
    while monotonic() < end:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            sleep(_LOOK_EVERY_S)
        except OSError:
            return False
        else:
            return True
    return False


def _path(folder: str, made_by: Sequence[str], inputs: object) -> Path:
    return cache_folder(folder) / f"{content_digest((inputs, _versions(made_by)))}.npz"


def _fit(arrays: Arrays, fits: Callable[[Arrays], bool]) -> bool:
    try:
        return fits(arrays)
    except (KeyError, ValueError):
        return False


def _versions(names: Sequence[str]) -> list[bytes | str]:
    """The source of modules of this package, and the versions of others."""
    return [
        Path(str(sys.modules[name].__file__)).read_bytes()
        if name.startswith("simgl.")
        else metadata.version(name)
        for name in names
    ]
