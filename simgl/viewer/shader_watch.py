"""Notices that shader files were changed."""

from __future__ import annotations

import time
from pathlib import Path

# Between two looks [s].
_INTERVAL = 0.5

Stamp = tuple[tuple[str, int, int], ...]


class ShaderWatch:
    """Looks at times and sizes of the files in a folder, twice a second at most."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._stamp = self._look()
        self._looked_at = time.monotonic()

    def _look(self) -> Stamp:
        stamps = []
        for path in sorted(self._folder.rglob("*")):
            try:
                status = path.stat()
            except OSError:
                # An editor replaces a file by another one.
                continue
            stamps.append((str(path), status.st_mtime_ns, status.st_size))
        return tuple(stamps)

    def has_changed(self) -> bool:
        """Whether a file is another one than when this was last so."""
        now = time.monotonic()
        if now - self._looked_at < _INTERVAL:
            return False
        self._looked_at = now
        before, self._stamp = self._stamp, self._look()
        return before != self._stamp
