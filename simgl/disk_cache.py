"""Arrays cached as files in the user's cache folder."""

from __future__ import annotations

import logging
import os
import tempfile
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from simgl.arrays import AnyArray
from simgl.decoded_files import arrays_in
from simgl.errors import AssetError
from simgl.input_files import read_file

# Of each folder: an arm on the move leaves a file with every step.
MAX_BYTES = 4 << 30

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


def read_arrays(path: Path) -> dict[str, AnyArray] | None:
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
        _LOG.warning("%s: %s; %s", path.parent, error.strerror, consequence)


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


def computed_once(name: str, compute: Callable[[], dict[str, AnyArray]]) -> dict[str, AnyArray]:
    """Arrays that numpy and scipy compute from constants, from a file after the first time.

    name : of the file; says what the arrays depend on besides the versions of both libraries
    """
    path = cache_folder("noise") / f"{name}-numpy{np.__version__}-scipy{scipy.__version__}.npz"
    arrays = read_arrays(path)
    if arrays is None:
        arrays = compute()
        write_arrays(path, arrays, "noise is computed again next time")
    return arrays
