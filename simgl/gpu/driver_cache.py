"""Mesa's cache of compiled shaders, made safe against a full disk before Mesa opens it.

Mesa maps the index of its cache into memory. The file is sparse, so that a disk or a quota that
fills up later kills the process with SIGBUS at some write to the index. Here its blocks are
allocated first; where that fails, Mesa does without the cache. Its other files are safe.
"""

from __future__ import annotations

import logging
import os
import pwd
import stat
from pathlib import Path

_LOG = logging.getLogger(__name__)

# 2^16 keys of 20 bytes and their number.
_INDEX_BYTES = (1 << 16) * 20 + 8
_DISABLED = "MESA_SHADER_CACHE_DISABLE"


def protect_driver_cache() -> None:
    """To be called before a context is opened."""
    if os.environ.get(_DISABLED, "").lower() in ("1", "true", "y", "yes"):
        return
    folder = Path()
    try:
        folder = _folder()
        folder.mkdir(parents=True, exist_ok=True)
        _allocate(folder / "index")
    except (OSError, KeyError) as error:
        os.environ[_DISABLED] = "true"
        reason = error.strerror if isinstance(error, OSError) else "no home folder"
        _LOG.warning("%s: %s; OpenGL compiles its shaders again next time", folder, reason)


def _folder() -> Path:
    """Where Mesa has its cache; KeyError for a user without a home folder."""
    base = os.environ.get("MESA_SHADER_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME")
    home = Path(pwd.getpwuid(os.getuid()).pw_dir)
    return (Path(base) if base else home / ".cache") / "mesa_shader_cache"


def _allocate(path: Path) -> None:
    # Neither waits for a FIFO's other end nor follows a link.
    handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NONBLOCK | os.O_NOFOLLOW, 0o644)
    try:
        status = os.fstat(handle)
        if not stat.S_ISREG(status.st_mode):
            raise FileExistsError(0, "its index is not a file")
        if status.st_blocks * 512 < _INDEX_BYTES:
            os.posix_fallocate(handle, 0, _INDEX_BYTES)
    finally:
        os.close(handle)
