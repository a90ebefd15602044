"""Arrays kept as files in the user's cache: what takes seconds is made once on a machine."""

from __future__ import annotations

import os
import tempfile
import warnings
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import scipy

Arrays = dict[str, "np.ndarray[Any, np.dtype[Any]]"]


def cache_folder(what: str) -> Path:
    """``$XDG_CACHE_HOME/simgl/WHAT``, or the same under ``~/.cache``."""
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "simgl" / what


def read_arrays(path: Path) -> Arrays | None:
    """What a file holds; None where there is none, or it is damaged (each array has a checksum)."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as data:
            return {name: data[name] for name in data.files}
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None


def write_arrays(path: Path, arrays: Mapping[str, Any], otherwise: str) -> None:
    """Written beside its place and renamed: a reader never meets half a file.

    otherwise : what follows where the folder cannot be written, for the warning
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".part", delete=False) as part:
            temporary = Path(part.name)
            try:
                np.savez(part, **arrays)
            except BaseException:
                temporary.unlink()
                raise
        temporary.replace(path)
    except OSError as error:
        message = f"{path.parent}: {error.strerror}; {otherwise}"
        warnings.warn(message, RuntimeWarning, stacklevel=5)


def computed_once(name: str, compute: Callable[[], Arrays]) -> Arrays:
    """Arrays that numpy and scipy compute from constants, from a file after the first time.

    name : of the file; says what the arrays depend on besides the versions of both libraries
    """
    path = cache_folder("noise") / f"{name}-numpy{np.__version__}-scipy{scipy.__version__}.npz"
    arrays = read_arrays(path)
    if arrays is None:
        arrays = compute()
        write_arrays(path, arrays, "noise is computed again next time")
    return arrays
