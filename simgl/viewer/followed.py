"""A running server in a window: the newest of its previews, which it sends whether seen or not."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from simgl.arrays import Image8
from simgl.errors import ConfigError
from simgl.physics.ephemeris import utc_from_tai_ns
from simgl.viewer.subject import DnOfImage, Panel, Size

# The bridge says by this group how previews are received.
PREVIEWS_GROUP = "simgl.previews"
_NOTHING_YET: Image8 = np.zeros((3, 4, 3), np.uint8)


class FollowedImage(Protocol):
    """A preview: see ``simgl_bridge.preview.PreviewImage``."""

    @property
    def pixels(self) -> Image8:
        """(height, width, 3) sRGB."""

    @property
    def camera(self) -> str:
        """Its name."""

    @property
    def tai_ns(self) -> int:
        """Epoch [TAI ns]."""

    @property
    def sequence(self) -> int:
        """Number of the server's reply."""

    @property
    def missed(self) -> int:
        """Previews since the last one that never arrived."""


class PreviewSource(Protocol):
    """Receives a server's previews."""

    def newest(self) -> FollowedImage | None:
        """The newest preview since the last call, without waiting; None where there is none."""

    def close(self) -> None:
        """Disconnect."""


def preview_source(address: str) -> PreviewSource:
    """Receives the previews of a server; raises ConfigError where the bridge is not installed."""
    for entry in entry_points(group=PREVIEWS_GROUP):
        make: Callable[[str], Any] = entry.load()
        source: PreviewSource = make(address)
        return source
    raise ConfigError("command line", "--follow", "needs the bridge: reinstall simgl")


class FollowedPreviews:
    """A ``Subject``: what a server's clients are sent, as previews.

    address : of the server's monitor
    """

    help: Sequence[tuple[str, str]] = ()
    runs, is_playing, error = True, False, ""

    def __init__(self, address: str, source: PreviewSource) -> None:
        self._address, self._source = address, source
        self._image: FollowedImage | None = None
        self._missed = 0
        self.number = 0

    def press(self, key: str) -> str | None:
        """No key changes what a loop does."""
        del key
        return None

    def drag(self, right: float, down: float) -> None:
        """The camera is the loop's."""

    def scroll(self, steps: float) -> None:
        """The camera is the loop's."""

    def advance(self, seconds: float) -> None:
        """Time is the loop's."""

    def update(self, window: Size) -> str | None:
        """Take the newest preview, if there is a new one."""
        del window
        image = self._source.newest()
        if image is not None:
            self._image = image
            self._missed += image.missed
            self.number += 1
        return None

    @property
    def _pixels(self) -> Image8:
        return _NOTHING_YET if self._image is None else self._image.pixels

    def panels(self) -> Sequence[Panel]:
        """The preview."""
        height, width = self._pixels.shape[:2]
        name = "no preview yet" if self._image is None else "preview, 8 bits"
        return (Panel(name=name, size=(width, height), pixels=self._pixels),)

    def info(self) -> list[str]:
        """Lines about the newest preview."""
        image = self._image
        if image is None:
            return [f"follows {self._address}", "waits for its first preview; h for help"]
        return [
            f"{utc_from_tai_ns(image.tai_ns)[:23]} UTC",
            f"follows {self._address}",
            f"camera {image.camera}, reply {image.sequence}",
            f"{self.number} previews, {self._missed} missed; h for help",
        ]

    def pixel(self, column: int, row: int) -> list[str]:
        """The code values of a pixel; physical ones are not in a preview."""
        height, width = self._pixels.shape[:2]
        if self._image is None or not (0 <= column < width and 0 <= row < height):
            return []
        codes = " ".join(str(code) for code in self._pixels[row, column].tolist())
        return [f"pixel {column}, {row} of the preview", f"sRGB {codes}"]

    def dn(self) -> DnOfImage | None:
        """A preview holds none."""
        return None

    def caption(self, frame_rate: float | None) -> str:
        """Of the window."""
        del frame_rate
        return f"simgl | follows {self._address}"

    def save_data(self, folder: Path, name: str) -> list[Path]:
        """A preview has no data beside the window's image."""
        del folder, name
        return []
