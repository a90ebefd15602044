"""What lies over the image: text, histogram and scale bar, each as a small picture with opacity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import matplotlib
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from simgl.arrays import Array, Image8, Image16
from simgl.camera.detector import Detector
from simgl.figures.displays import Scale
from simgl.figures.style import INK, ORANGE, PAPER, RED, SKY, SOFT, on_dark
from simgl.images import saturation_level

# Of the text, at a content scale of 1 [px].
_TEXT_SIZE = 13
# Behind the text: white text stays at 7:1 over a white image (WCAG 2.2 asks for 4.5:1).
_OPACITY = 214
_HISTOGRAM_BARS, _HISTOGRAM_HEIGHT = 128, 72
_SCALE_WIDTH, _SCALE_HEIGHT = 220, 12


@dataclass(frozen=True, kw_only=True)
class BoxStyle:
    """The look of all boxes.

    content_scale : pixels of the window for each that a screen of 96 dots an inch has
    """

    content_scale: float = 1.0

    @property
    def text_size(self) -> int:
        """[px]."""
        return max(8, round(_TEXT_SIZE * self.content_scale))

    @property
    def margin(self) -> int:
        """Between text and the edge of its box [px]."""
        return round(0.6 * self.text_size)

    def pixels(self, length: float) -> int:
        """A length at a content scale of 1, in pixels."""
        return max(1, round(length * self.content_scale))


@lru_cache(maxsize=8)
def _font(size: int) -> ImageFont.FreeTypeFont:
    path = Path(matplotlib.get_data_path(), "fonts", "ttf", "DejaVuSansMono.ttf")
    return ImageFont.truetype(path, size)


def rgb(colour: str) -> tuple[int, int, int]:
    """Of "#rrggbb", 0..255."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


_INK, _SOFT, _PAPER = (rgb(on_dark(colour)) for colour in (INK, SOFT, PAPER))
_MARK, _LABEL, _BARS = rgb(RED), rgb(ORANGE), rgb(SKY)


class _Sheet:
    """A box with room for lines of text and something below them."""

    def __init__(
        self, style: BoxStyle, lines: Sequence[str], width: int = 0, height: int = 0
    ) -> None:
        self.style, self.font = style, _font(style.text_size)
        self.line_height = round(1.35 * style.text_size)
        text_width = max((round(self.font.getlength(line)) for line in lines), default=0)
        self.top = style.margin + self.line_height * len(lines)
        size = (max(text_width, width) + 2 * style.margin, self.top + height + style.margin)
        self.image = Image.new("RGBA", size, (*_PAPER, _OPACITY))
        self.draw = ImageDraw.Draw(self.image)

    def write(self, row: int, text: str, colour: tuple[int, int, int] = _INK) -> None:
        """A line of text, from the top."""
        place = self.style.margin, self.style.margin + row * self.line_height
        self.draw.text(place, text, fill=(*colour, 255), font=self.font)

    def pixels(self) -> Image8:
        """(height, width, 4)."""
        return np.array(self.image)


def text_box(lines: Sequence[str], style: BoxStyle, *, warns: bool = False) -> Image8:
    """(height, width, 4) of lines of text; the first is a heading, orange where it warns."""
    sheet = _Sheet(style, lines)
    for row, line in enumerate(lines):
        sheet.write(row, line, _LABEL if warns and row == 0 else _INK)
    return sheet.pixels()


def histogram(dn: Image16, detector: Detector) -> tuple[Array, int]:
    """Number of pixels by DN in 128 bins up to full scale, and the bin of the saturation level.

    dn : (height, width)
    returns : (128,), and 0..127
    """
    steps = (int(detector.largest_dn) + 1) / _HISTOGRAM_BARS
    place = np.minimum(dn / steps, _HISTOGRAM_BARS - 1).astype(np.int64)
    counts = np.bincount(place.ravel(), minlength=_HISTOGRAM_BARS).astype(np.float64)
    return counts, min(int(saturation_level(detector) / steps), _HISTOGRAM_BARS - 1)


def histogram_box(dn: Image16, detector: Detector, share: float, style: BoxStyle) -> Image8:
    """(height, width, 4): pixels by DN, their number logarithmic, what is saturated in red.

    share : of saturated pixels, 0..1
    """
    level = saturation_level(detector)
    lines = [
        f"DN   median {np.median(dn):.0f}, largest {int(dn.max())}",
        f"saturated from {level}: {100.0 * share:.3g} %",
    ]
    bar = style.pixels(2)
    height = style.pixels(_HISTOGRAM_HEIGHT)
    sheet = _Sheet(style, [*lines, ""], bar * _HISTOGRAM_BARS, height)
    sheet.write(0, lines[0])
    sheet.write(1, lines[1], _LABEL if share else _INK)
    counts, mark = histogram(dn, detector)
    heights = np.round(height * np.log1p(counts) / np.log1p(max(counts.max(), 1.0))).astype(int)
    top = sheet.top - sheet.line_height
    bottom = top + height
    for place, high in enumerate(heights.tolist()):
        left = style.margin + place * bar
        if high:
            colour = _MARK if place >= mark else _BARS
            sheet.draw.rectangle(
                [left, bottom - high, left + bar - 1, bottom - 1], fill=(*colour, 255)
            )
    at = style.margin + mark * bar
    sheet.draw.line([at, top, at, bottom], fill=(*_MARK, 255), width=max(1, bar // 2))
    _ends(sheet, bottom, "0", str(int(detector.largest_dn)), bar * _HISTOGRAM_BARS)
    return sheet.pixels()


def scale_box(scale: Scale, style: BoxStyle) -> Image8:
    """(height, width, 4): what colours stand for, from low to high, with the unit."""
    kind = ", logarithmic" if scale.logarithmic else ""
    lines = [f"{scale.quantity} [{scale.unit}]{kind}", ""]
    width, height = style.pixels(_SCALE_WIDTH), style.pixels(_SCALE_HEIGHT)
    sheet = _Sheet(style, lines, width, height)
    sheet.write(0, lines[0])
    stops = np.array([rgb(colour) for colour in scale.colours], dtype=np.float64)
    along = np.linspace(0.0, len(stops) - 1.0, width)
    ramp = np.stack([np.interp(along, np.arange(len(stops)), c) for c in stops.T], axis=-1)
    pixels = np.round(np.broadcast_to(ramp, (height, width, 3))).astype(np.uint8)
    top = sheet.top - sheet.line_height
    sheet.image.paste(Image.fromarray(pixels), (style.margin, top))
    frame = [style.margin - 1, top - 1, style.margin + width, top + height]
    sheet.draw.rectangle(frame, outline=(*_SOFT, 255))
    for share in _decades(scale):
        x = style.margin + round(share * (width - 1))
        sheet.draw.line([x, top + height // 2, x, top + height], fill=(*_INK, 255))
    _ends(sheet, top + height, f"{scale.low:.5g}", f"{scale.high:.5g}", width)
    return sheet.pixels()


def _decades(scale: Scale) -> list[float]:
    """Where on a logarithmic scale the powers of ten between its ends lie, 0..1."""
    if not scale.logarithmic:
        return []
    low, high = np.log10(scale.low), np.log10(scale.high)
    inner = np.arange(np.floor(low + 1e-9) + 1.0, high - 1e-9)
    return [float(x) for x in (inner - low) / (high - low)]


def _ends(sheet: _Sheet, top: int, low: str, high: str, width: int) -> None:
    """The values at the ends of an axis, below it."""
    margin, y = sheet.style.margin, top + sheet.style.pixels(2)
    sheet.draw.text((margin, y), low, fill=(*_INK, 255), font=sheet.font)
    right = margin + width - round(sheet.font.getlength(high))
    sheet.draw.text((right, y), high, fill=(*_INK, 255), font=sheet.font)
