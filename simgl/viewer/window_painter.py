"""Draws a window: images side by side, and over them what is to be read."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np

from simgl.arrays import Array32, Image8
from simgl.figures.style import LINE, on_dark
from simgl.gpu.release import all_or_nothing
from simgl.passes.display import DisplayPass
from simgl.viewer.overlay import InsetTextures, PlacedBox, Rectangle, separated
from simgl.viewer.overlay_boxes import BoxStyle, histogram_box, rgb, scale_box, text_box
from simgl.viewer.subject import Panel, Size, Subject, fitted

_RED, _GREEN, _BLUE = (code / 255.0 for code in rgb(on_dark(LINE)))
_AROUND = (_RED, _GREEN, _BLUE, 1.0)

# Longest line of an error, in characters.
_LONGEST_LINE = 90
_MAX_ERROR_LINES = 12
# Between images side by side [px].
_GAP = 4


@dataclass(frozen=True, kw_only=True)
class Words:
    """What the window says besides the subject's lines.

    message : what has just changed; empty for nothing
    help : keys and what they do; empty where help is closed
    pixel : column and row under the mouse; None outside the images
    text : whether anything is written at all
    """

    message: str = ""
    help: Sequence[tuple[str, str]] = ()
    pixel: tuple[int, int] | None = None
    text: bool = True


def places(panels: Sequence[Panel], window: Size) -> list[tuple[Rectangle, Rectangle]]:
    """Of each image: its part of the window, and where in it it lies [px], y upwards."""
    width = window[0] // len(panels)
    gap = _GAP if len(panels) > 1 else 0
    rectangles = []
    for index, panel in enumerate(panels):
        x, y, *size = fitted(panel.size, (max(1, width - gap), window[1]))
        part = index * width, 0, width, window[1]
        rectangles.append((part, (index * width + x, y, size[0], size[1])))
    return rectangles


def pixel_at(
    panels: Sequence[Panel], window: Size, place: tuple[float, float]
) -> tuple[int, int] | None:
    """Column and row of the image under a place in the window [px], y downwards."""
    for panel, (_, (x, y, width, height)) in zip(panels, places(panels, window), strict=True):
        right, down = place[0] - x, place[1] - (window[1] - y - height)
        if 0.0 <= right < width and 0.0 <= down < height:
            columns, rows = panel.size
            return int(right * columns / width), int(down * rows / height)
    return None


class WindowPainter:
    """Draws subjects into framebuffers of one context.

    written : the lines of each box that the last drawing showed, by its name
    """

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._display = DisplayPass(ctx)
        self._insets = InsetTextures(ctx)
        self._radiance: tuple[Array32, moderngl.Texture] | None = None
        self._boxes: dict[str, tuple[tuple[Any, ...], Image8]] = {}
        self.written: dict[str, list[str]] = {}

    def draw(
        self,
        subject: Subject,
        words: Words,
        style: BoxStyle,
        target: moderngl.Framebuffer,
        window: Size,
    ) -> None:
        """Fill a window of a size: the images, grey around them, and the boxes over them."""
        # Around an image, whose sky is black, the window is not.
        target.clear(color=_AROUND, viewport=(0, 0, *target.size))
        panels = subject.panels()
        for index, (panel, (_, rectangle)) in enumerate(
            zip(panels, places(panels, window), strict=True)
        ):
            self._draw_panel(f"panel {index}", panel, target, rectangle)
        self.written = {}
        if words.text:
            boxes = self._placed(subject, words, style, window)
            rectangles = separated([box for _, box in boxes])
            for (name, box), rectangle in zip(boxes, rectangles, strict=True):
                self._insets.draw(name, box.pixels, target, rectangle)

    def _draw_panel(
        self, name: str, panel: Panel, target: moderngl.Framebuffer, rectangle: Rectangle
    ) -> None:
        if panel.pixels is not None:
            self._insets.draw(name, panel.pixels, target, rectangle)
            return
        assert panel.radiance is not None
        if self._radiance is None or self._radiance[0] is not panel.radiance:
            if self._radiance is not None:
                self._radiance[1].release()
            height, width, channels = panel.radiance.shape
            data = np.ascontiguousarray(panel.radiance)
            texture = self._ctx.texture((width, height), channels, data.tobytes(), dtype="f4")
            texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
            self._radiance = panel.radiance, texture
        self._display.draw(self._radiance[1], target, rectangle, panel.exposure_value, panel.bands)

    def _placed(
        self, subject: Subject, words: Words, style: BoxStyle, window: Size
    ) -> list[tuple[str, PlacedBox]]:
        everywhere = (0, 0, *window)
        gap = style.pixels(8)

        def text(
            name: str, lines: list[str], anchor: str, within: Rectangle, *, warns: bool = False
        ) -> tuple[str, PlacedBox]:
            self.written[name] = lines
            key = tuple(lines), style, warns
            pixels = self._box(name, key, lambda: text_box(lines, style, warns=warns))
            return name, PlacedBox(pixels=pixels, anchor=anchor, within=within, gap=gap)

        if words.help:
            columns = max(len(keys) for keys, _ in words.help)
            lines = ["keys", *(f"{keys:<{columns}}  {meaning}" for keys, meaning in words.help)]
            return [text("help", lines, "middle", everywhere, warns=True)]
        boxes = [text("info", subject.info(), "top left", everywhere)]
        panels = subject.panels()
        for index, (panel, (part, _)) in enumerate(
            zip(panels, places(panels, window), strict=True)
        ):
            boxes.append(self._name_of(f"name {index}", panel, part, style, gap))
        if words.pixel is not None and (lines := subject.pixel(*words.pixel)):
            boxes.append(text("pixel", lines, "bottom left", everywhere))
        if (dn := subject.dn()) is not None:
            pixels = self._box(
                "histogram",
                (dn.dn, style),
                lambda: histogram_box(dn.dn, dn.detector, dn.saturated_share, style),
            )
            place = PlacedBox(pixels=pixels, anchor="bottom right", within=everywhere, gap=gap)
            boxes.append(("histogram", place))
        if words.message:
            boxes.append(text("message", [words.message], "bottom", everywhere))
        if subject.error:
            lines = [part for line in subject.error.splitlines() for part in _wrapped(line)]
            shown = lines[:_MAX_ERROR_LINES]
            boxes.append(text("error", shown, "middle", everywhere, warns=True))
        return boxes

    def _name_of(
        self, name: str, panel: Panel, part: Rectangle, style: BoxStyle, gap: int
    ) -> tuple[str, PlacedBox]:
        """What an image shows, with the scale of its colours."""
        scale = panel.scale
        if scale is None:
            self.written[name] = [panel.name]
            pixels = self._box(name, (panel.name, style), lambda: text_box([panel.name], style))
        else:
            self.written[name] = [scale.quantity, scale.unit, f"{scale.low:g}", f"{scale.high:g}"]
            pixels = self._box(name, (scale, style), lambda: scale_box(scale, style))
        return name, PlacedBox(pixels=pixels, anchor="top right", within=part, gap=gap)

    def _box(self, name: str, key: tuple[Any, ...], make: Callable[[], Image8]) -> Image8:
        """A box, made anew where its key is another one; arrays are told apart by identity."""
        known = self._boxes.get(name)
        if known is None or not _are_same(known[0], key):
            known = self._boxes[name] = key, make()
        return known[1]

    def release(self) -> None:
        """Free everything."""
        if self._radiance is not None:
            self._radiance[1].release()
            self._radiance = None
        self._insets.release()
        self._display.release()

    def __enter__(self) -> WindowPainter:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()


def _are_same(a: tuple[Any, ...], b: tuple[Any, ...]) -> bool:
    return len(a) == len(b) and all(
        x is y or (not isinstance(x, np.ndarray) and x == y) for x, y in zip(a, b, strict=True)
    )


def _wrapped(line: str) -> list[str]:
    return textwrap.wrap(line, _LONGEST_LINE) or [""]


def read_window(target: moderngl.Framebuffer, size: Size) -> Image8:
    """(height, width, 3) content of a window's framebuffer, row 0 at the top."""
    data = target.read(viewport=(0, 0, *size), components=3, alignment=1)
    return np.frombuffer(data, np.uint8).reshape(size[1], size[0], 3)[::-1]
