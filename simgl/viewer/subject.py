"""What a window shows and who answers its keys: a scenario, or a running server's previews."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from simgl.arrays import Array32, Image8, Image16
from simgl.camera.detector import Detector
from simgl.figures.displays import Scale
from simgl.physics.spectrum import BANDS, Bands

Size = tuple[int, int]


def fitted(image: Size, window: Size) -> tuple[int, int, int, int]:
    """x, y, width, height [px] of the largest centred place for an image in a window."""
    scale = min(window[0] / image[0], window[1] / image[1])
    width, height = (max(1, round(scale * side)) for side in image)
    return (window[0] - width) // 2, (window[1] - height) // 2, width, height


@dataclass(frozen=True, kw_only=True, eq=False)
class Panel:
    """An image in the window.

    name : of what it shows
    size : columns and rows of the image
    pixels : (height, width, 3) sRGB, perhaps subsampled; None where ``radiance`` is shown
    radiance : (height, width, 4) [W m-2 sr-1], shown as an eye would see it
    exposure_value : brightens the radiance by two to this power [EV]
    bands : of the radiance
    scale : of the colours, where they stand for values
    """

    name: str
    size: Size
    pixels: Image8 | None = None
    radiance: Array32 | None = None
    exposure_value: float = 0.0
    bands: Bands = BANDS
    scale: Scale | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class DnOfImage:
    """What the histogram shows: (height, width) DN, their detector, and the saturated share."""

    dn: Image16
    detector: Detector
    saturated_share: float


class Subject(Protocol):
    """What a window shows."""

    @property
    def help(self) -> Sequence[tuple[str, str]]:
        """Keys and what they do, beside those of every window."""

    @property
    def runs(self) -> bool:
        """Whether it changes by itself, without waiting for events."""

    @property
    def is_playing(self) -> bool:
        """Whether its time goes by."""

    @property
    def error(self) -> str:
        """What is wrong for longer than a moment, such as an error in a shader; empty if nothing"""

    def press(self, key: str) -> str | None:
        """Obey a key; what has changed, in words. None for a key that means nothing here."""

    def drag(self, right: float, down: float) -> None:
        """The image was dragged by two angles [rad]."""

    def scroll(self, steps: float) -> None:
        """The wheel was turned away from the user."""

    def advance(self, seconds: float) -> None:
        """Some of the user's time went by."""

    def update(self, window: Size) -> str | None:
        """Bring the image up to date for a framebuffer's size; what went wrong, in words."""

    @property
    def number(self) -> int:
        """Counts what there is to see: another number, another look."""

    def panels(self) -> Sequence[Panel]:
        """The images side by side."""

    def info(self) -> list[str]:
        """Lines about the images."""

    def pixel(self, column: int, row: int) -> list[str]:
        """Lines about a pixel of the images; none outside them."""

    def dn(self) -> DnOfImage | None:
        """For the histogram; None where none is to be shown."""

    def caption(self, frame_rate: float | None) -> str:
        """Of the window; frame_rate : of images [Hz]."""

    def save_data(self, folder: Path, name: str) -> list[Path]:
        """Write the data of the images; the files written."""
