"""Sweep: what pixels see over an exposure, from a picture of its middle and the ways across it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import moderngl
import numpy as np

from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.pipeline_state import State
from simgl.gpu.release import all_or_nothing
from simgl.gpu.render_targets import ImageTarget, table_texture
from simgl.gpu.uniform_blocks import Block
from simgl.view.image_paths import Box, ImagePaths

_SWEEP = Block(
    "Sweep",
    30,
    np.dtype(
        [
            # Of the picture around what is drawn from it [px].
            ("margin", "f4", 2),
            # Of the first node of the paths, and from a node to the next [px].
            ("nodes_origin", "f4", 2),
            # From and to when the picture stands for what is seen; exposure times from the epoch.
            ("segment", "f4", 2),
            ("nodes_step", "f4"),
            # Its own moment [exposure times].
            ("moment", "f4"),
            # Row that is exposed about the epoch, and from a row to the next [exposure times].
            ("middle_row", "f4"),
            ("row_rate", "f4"),
            # Of the exposure, for each unit of the segment.
            ("share", "f4"),
            # Places on either side of the middle, or chunks.
            ("count", "i4"),
        ]
    ),
)

# Places on either side of the middle that are read one by one; a longer way is swept in two steps,
# which are a little less sharp across it.
_MOST_PLACES = 16


@dataclass(frozen=True, kw_only=True)
class Span:
    """Which times a picture stands for, in exposure times from the epoch.

    first, last : of the rows' exposures around their middles
    moment : of the picture
    row_rate : from a row's exposure to the next one's; 0 where the picture shows each row at its
        own time
    middle_row : whose exposure is about the epoch
    """

    first: float = -0.5
    last: float = 0.5
    moment: float = 0.0
    row_rate: float = 0.0
    middle_row: float = 0.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Sweep:
    """What is swept, and where it goes.

    size : of the picture [px]
    filled : x, y, width, height of what is swept in it; it is the same all around
    margin : of the picture around the target [px]
    target_size : of that [px]
    share : of the exposure
    """

    paths: ImagePaths
    size: tuple[int, int]
    filled: Box
    margin: tuple[int, int] = (0, 0)
    target_size: tuple[int, int]
    span: Span = Span()
    share: float = 1.0

    def reach(self, part: float = 1.0) -> tuple[int, int]:
        """How far it goes from where it is in a part of the exposure, along x and y [px]."""
        x, y = (int(np.ceil(0.5 * part * way)) + 3 for way in self.paths.reach)
        return x, y

    @property
    def area(self) -> Box:
        """Of the target, where it may go."""
        x, y, width, height = grown(self.filled, self.reach(), self.size)
        x0, y0 = max(x - self.margin[0], 0), max(y - self.margin[1], 0)
        x1 = min(x + width - self.margin[0], self.target_size[0])
        y1 = min(y + height - self.margin[1], self.target_size[1])
        return x0, y0, max(x1 - x0, 0), max(y1 - y0, 0)

    @property
    def read(self) -> Box:
        """Of the picture, what is read."""
        x, y = self.reach()
        return grown(self.filled, (2 * x, 2 * y), self.size)


def grown(box: Box, reach: tuple[int, int], size: tuple[int, int]) -> Box:
    """x, y, width, height of a box with what is around it in a target of a size [px]."""
    x, y, width, height = box
    x0, y0 = max(x - reach[0], 0), max(y - reach[1], 0)
    x1, y1 = min(x + width + reach[0], size[0]), min(y + height + reach[1], size[1])
    return x0, y0, max(x1 - x0, 0), max(y1 - y0, 0)


class SweepPass:
    """Fills, adds to or dims a target with a picture swept along its paths."""

    fills = State()
    adds = State(blend=(moderngl.ONE, moderngl.ONE))
    dims = State(blend=(moderngl.ZERO, moderngl.SRC_COLOR))

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        samplers = ["picture", "paths"]
        self._places = FullscreenProgram(ctx, "sweep/sweep", _SWEEP, samplers)
        self._chunks = FullscreenProgram(ctx, "sweep/sweep", _SWEEP, samplers, ["CHUNKS"])

    def draw(
        self,
        sweep: Sweep,
        picture: ImageTarget,
        target: moderngl.Framebuffer,
        state: State,
        spare: Callable[[], ImageTarget],
        empty: float = 0.0,
    ) -> None:
        """Draw what the area of a sweep sees.

        picture : of the size of the sweep's picture, filled where the sweep reads it
        state : of this class, how it goes into the target
        spare : makes another target of the picture's size
        empty : what the picture holds around what is to be swept
        """
        longest = max(sweep.paths.reach)
        if longest <= 2 * _MOST_PLACES + 1:
            count = _places(longest)
            self._draw(self._places, sweep, picture, target, sweep.area, state, count)
            return
        # In two steps: the picture swept by an equal part of the way, and such parts side by side.
        chunks = int(np.ceil(longest / _MOST_PLACES))
        half = 0.5 / chunks
        part = replace(sweep, margin=(0, 0), span=Span(first=-half, last=half), share=float(chunks))
        between = spare()
        between.framebuffer.clear(empty, empty, empty, empty, viewport=sweep.read)
        area = grown(sweep.filled, sweep.reach(1.0 / chunks), between.size)
        count = _places(longest / chunks)
        self._draw(self._places, part, picture, between.framebuffer, area, self.fills, count)
        self._draw(self._chunks, sweep, between, target, sweep.area, state, chunks)

    def _draw(
        self,
        program: FullscreenProgram,
        sweep: Sweep,
        picture: ImageTarget,
        target: moderngl.Framebuffer,
        area: Box,
        state: State,
        count: int,
    ) -> None:
        paths, span, (seen,) = sweep.paths, sweep.span, picture.textures
        ways = table_texture(self._ctx, paths.nodes)
        for texture in (ways, seen):
            texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
            texture.repeat_x = texture.repeat_y = False
        values = {
            "margin": sweep.margin,
            "nodes_origin": paths.origin,
            "nodes_step": paths.step,
            "segment": (span.first, span.last),
            "moment": span.moment,
            "middle_row": span.middle_row,
            "row_rate": span.row_rate,
            "share": sweep.share,
            "count": count,
        }
        state.apply(self._ctx, target, (0, 0, *target.size), area)
        program.draw(values, [seen, ways])
        seen.filter = (moderngl.NEAREST, moderngl.NEAREST)
        ways.release()

    def release(self) -> None:
        """Free everything."""
        self._places.release()
        self._chunks.release()


def _places(way: float) -> int:
    """On either side of the middle, for ways of so many pixels (``sweep.frag``)."""
    return max(int(np.ceil(0.5 * (np.sqrt(way**2 + 1.0) - 1.0) - 1e-6)), 1)
