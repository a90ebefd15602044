"""Boxes over an image: each keeps its texture until its content changes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import moderngl

from simgl.arrays import Image8
from simgl.passes.inset import InsetPass

# x, y, width, height [px], y upwards.
Rectangle = tuple[int, int, int, int]


@dataclass(frozen=True, kw_only=True, eq=False)
class PlacedBox:
    """A picture with opacity and where it lies.

    pixels : (height, width, 4)
    anchor : words of "top", "bottom", "left", "right"; the middle where none of a kind is given
    within : x, y, width, height of the part of the window that it lies in [px], y upwards
    gap : to the edges of that part [px]
    """

    pixels: Image8
    anchor: str
    within: Rectangle
    gap: int

    @property
    def rectangle(self) -> Rectangle:
        """x, y, width, height in the window [px], y upwards."""
        height, width = self.pixels.shape[:2]
        x, y, room, storey = self.within
        if "left" in self.anchor:
            left = x + self.gap
        elif "right" in self.anchor:
            left = x + room - width - self.gap
        else:
            left = x + (room - width) // 2
        if "top" in self.anchor:
            low = y + storey - height - self.gap
        elif "bottom" in self.anchor:
            low = y + self.gap
        else:
            low = y + (storey - height) // 2
        return left, low, width, height


def separated(boxes: Sequence[PlacedBox]) -> list[Rectangle]:
    """Where boxes lie so that none covers one before it: further from the edge that they are at."""
    taken: list[Rectangle] = []
    for box in boxes:
        place = box.rectangle
        while (other := next((r for r in taken if _overlap(place, r)), None)) is not None:
            x, _, width, height = place
            up = other[1] + other[3] + box.gap
            down = other[1] - height - box.gap
            place = x, down if "top" in box.anchor else up, width, height
        taken.append(place)
    return taken


def _overlap(a: Rectangle, b: Rectangle) -> bool:
    return all(a[i] < b[i] + b[i + 2] and b[i] < a[i] + a[i + 2] for i in (0, 1))


class InsetTextures:
    """Textures of pictures by what they are for, each made anew when its content changes."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._pass = InsetPass(ctx)
        self._textures: dict[str, tuple[Image8, moderngl.Texture]] = {}

    def draw(
        self,
        name: str,
        pixels: Image8,
        target: moderngl.Framebuffer,
        rectangle: Rectangle,
    ) -> None:
        """Show a picture in a rectangle of a window [px], y upwards.

        pixels : (height, width, 3 or 4); another array has another content
        """
        known = self._textures.get(name)
        if known is None or known[0] is not pixels:
            if known is not None:
                known[1].release()
            height, width, channels = pixels.shape
            texture = self._ctx.texture((width, height), channels, pixels.tobytes(), alignment=1)
            # Pixels are seen as such where they are enlarged.
            texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.NEAREST)
            texture.build_mipmaps()
            known = self._textures[name] = pixels, texture
        self._pass.draw(known[1], target, rectangle)

    def release(self) -> None:
        """Free everything."""
        for _, texture in self._textures.values():
            texture.release()
        self._textures.clear()
        self._pass.release()
