"""Inset: an 8-bit image in a part of a window, over what is there."""

from __future__ import annotations

import moderngl
import numpy as np

from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.pipeline_state import State
from simgl.gpu.uniform_blocks import Block

_INSET = Block(
    "Inset",
    8,
    # x, y, width, height in the window [px], y upwards
    np.dtype([("place_in_window", "f4", 4)]),
)


class InsetPass:
    """A texture of sRGB code values, shown as it is where it is opaque."""

    state = State(blend=(moderngl.SRC_ALPHA, moderngl.ONE_MINUS_SRC_ALPHA))

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._program = FullscreenProgram(ctx, "inset/inset", _INSET, ["inset"])

    def draw(
        self,
        inset: moderngl.Texture,
        target: moderngl.Framebuffer,
        rectangle: tuple[int, int, int, int],
    ) -> None:
        """Fill a rectangle (x, y, width, height; y upwards) of an 8-bit target, its top row last.

        What lies outside the target is cut off.
        """
        self.state.apply(self._ctx, target, rectangle)
        self._program.draw({"place_in_window": rectangle}, [inset])

    def release(self) -> None:
        """Free everything."""
        self._program.release()
