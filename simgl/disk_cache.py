"""Arrays cached as files in the user's cache folder."""

from __future__ import annotations

import logging
import os
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from simgl.arrays import AnyArray

_LOG = logging.getLogger(__name__)


def cache_folder(name: str) -> Path:
    """``$XDG_CACHE_HOME/simgl/NAME``, or the same under ``~/.cache``."""
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "simgl" / name


def read_arrays(path: Path) -> dict[str, AnyArray] | None:
    """The arrays of a file; None if it is missing, or damaged (each array has a checksum)."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as data:
            return {name: data[name] for name in data.files}
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None


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
            except BaseException:
                temporary.unlink()
                raise
        temporary.replace(path)
    except OSError as error:
        _LOG.warning("%s: %s; %s", path.parent, error.strerror, consequence)
