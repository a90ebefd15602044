"""Average: the mean of snapshots of several moments."""

from __future__ import annotations

import moderngl
import numpy as np

from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.pipeline_state import State
from simgl.gpu.release import all_or_nothing
from simgl.gpu.uniform_blocks import Block
from simgl.view.image_paths import Box

_AVERAGE = Block("Average", 28, np.dtype([("share", "f4", 4)]))


class AveragePass:
    """Copies snapshots, and adds up shares of them."""

    fills = State()
    adds = State(blend=(moderngl.ONE, moderngl.ONE))

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._program = FullscreenProgram(ctx, "average/average", _AVERAGE, ["snapshot"])

    def copy(self, snapshot: moderngl.Texture, target: moderngl.Framebuffer, box: Box) -> None:
        """Fill a box of a target, x, y, width, height, with a snapshot of its size."""
        self.fills.apply(self._ctx, target, (0, 0, *target.size), box)
        self._program.draw({"share": np.ones(4)}, [snapshot])

    def add(
        self, snapshot: moderngl.Texture, share: float, target: moderngl.Framebuffer, box: Box
    ) -> None:
        """Add a share of a snapshot to a box of a target."""
        self.adds.apply(self._ctx, target, (0, 0, *target.size), box)
        self._program.draw({"share": np.full(4, share)}, [snapshot])

    def release(self) -> None:
        """Free everything."""
        self._program.release()
