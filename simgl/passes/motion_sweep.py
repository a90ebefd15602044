"""Sweep: what pixels see over an exposure, from a snapshot of its middle and the ways across it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import moderngl
import numpy as np

from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.pipeline_state import ONE_MINUS_SRC1_COLOR, State
from simgl.gpu.release import all_or_nothing
from simgl.gpu.render_targets import ImageTarget, table_texture
from simgl.gpu.uniform_blocks import Block
from simgl.view.image_paths import Box, ImagePaths

_SWEEP = Block(
    "Sweep",
    30,
    np.dtype(
        [
            # Left, upper, right and lower edge of what is filled of the snapshot [px].
            ("filled", "f4", 4),
            # Of the snapshot around what is drawn from it [px].
            ("margin", "f4", 2),
            # Of the first node of the paths, and from a node to the next [px].
            ("nodes_origin", "f4", 2),
            # From and to when the snapshot stands for what is seen; exposure times from the epoch.
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

# Longest ways that are swept in one step, and in two [px]. Steps of two or more read between pixels
# and widen edges along the motion by 0.2 square pixels each; one step of many places takes longer.
_ONE_STEP, _TWO_STEPS = 8.9, 80.0


@dataclass(frozen=True, kw_only=True)
class Span:
    """Which times a snapshot stands for, in exposure times from the epoch.

    first, last : of the rows' exposures around their middles
    moment : of the snapshot
    row_rate : from a row's exposure to the next one's; 0 where the snapshot shows each row at its
        own time
    middle_row : whose exposure is about the epoch
    """

    first: float = -0.5
    last: float = 0.5
    moment: float = 0.0
    row_rate: float = 0.0
    middle_row: float = 0.0


Spare = Callable[[int], ImageTarget]


@dataclass(frozen=True, kw_only=True, eq=False)
class Sweep:
    """What is swept, and where it goes. Around what is filled the snapshot is empty.

    size : of the snapshot [px]
    filled : x, y, width, height of that
    margin : of the snapshot around the target [px]
    target_size : of that [px]
    share : of the exposure
    edges : whether it shows edges, which are to stay as sharp as they are across the motion
    """

    paths: ImagePaths
    size: tuple[int, int]
    filled: Box
    margin: tuple[int, int] = (0, 0)
    target_size: tuple[int, int]
    span: Span = Span()
    share: float = 1.0
    edges: bool = False

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

    @cached_property
    def uneven(self) -> bool:
        """Whether what it shows accelerates."""
        return self.paths.uneven

    @property
    def fine(self) -> bool:
        """Whether places between pixels are told from four of them."""
        return self.edges and max(self.paths.reach) <= _ONE_STEP

    @property
    def steps(self) -> tuple[int, ...]:
        """Places on either side of the middle in the first step, and the chunks of each further."""
        way = max(self.paths.reach)
        return (_places(way),) if self.uneven else _steps(way)

    def read(self, step: int = 0) -> Box:
        """What a step reads of the snapshot, or of what the step before has made of it."""
        part = 1.0 / float(np.prod(self.steps[step + 1 :], dtype=np.float64))
        x, y = self.reach(part)
        return grown(self.filled, (2 * x, 2 * y), self.size)


def grown(box: Box, reach: tuple[int, int], size: tuple[int, int]) -> Box:
    """x, y, width, height of a box with what is around it in a target of a size [px]."""
    x, y, width, height = box
    x0, y0 = max(x - reach[0], 0), max(y - reach[1], 0)
    x1, y1 = min(x + width + reach[0], size[0]), min(y + height + reach[1], size[1])
    return x0, y0, max(x1 - x0, 0), max(y1 - y0, 0)


class SweepPass:
    """Sweeps snapshots into targets, or over what these hold."""

    fills = State()
    adds = State(blend=(moderngl.ONE, moderngl.ONE))
    lays = State(blend=(moderngl.ONE, ONE_MINUS_SRC1_COLOR))

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._programs: dict[tuple[str, ...], FullscreenProgram] = {}

    def fill(
        self, sweep: Sweep, snapshot: ImageTarget, target: moderngl.Framebuffer, spare: Spare
    ) -> None:
        """Fill the area of a sweep; spare : makes other targets like the snapshot, by a number."""
        self._draw(sweep, snapshot, target, self.fills, spare)

    def add(
        self, sweep: Sweep, snapshot: ImageTarget, target: moderngl.Framebuffer, spare: Spare
    ) -> None:
        """Add to what a target holds there."""
        self._draw(sweep, snapshot, target, self.adds, spare)

    def lay_over(
        self, sweep: Sweep, snapshot: ImageTarget, target: moderngl.Framebuffer, spare: Spare
    ) -> None:
        """Lay a snapshot over it: of radiance, and the covered share of each pixel."""
        self._draw(sweep, snapshot, target, self.lays, spare)

    def _draw(
        self,
        sweep: Sweep,
        snapshot: ImageTarget,
        target: moderngl.Framebuffer,
        state: State,
        spare: Spare,
    ) -> None:
        steps = sweep.steps
        ways = table_texture(self._ctx, sweep.paths.nodes)
        _interpolate(ways)
        part, seen = 1.0 / float(np.prod(steps[1:], dtype=np.float64)), snapshot
        for number, count in enumerate(steps):
            chunks = number > 0
            if chunks:
                part *= count
            last = number == len(steps) - 1
            if last:
                into, area, how, span = target, sweep.area, state, sweep
            else:
                # In a snapshot of its own, over a part of the exposure.
                between = spare(number % 2)
                between.framebuffer.clear(viewport=sweep.read(number + 1))
                area = grown(sweep.filled, sweep.reach(part), sweep.size)
                half = Span(first=-0.5 * part, last=0.5 * part)
                span = replace(sweep, margin=(0, 0), span=half, share=1.0 / part)
                into, how = between.framebuffer, self.fills
            how.apply(self._ctx, into, (0, 0, *into.size), area)
            for texture in seen.textures:
                _interpolate(texture)
            defines = ("COVERED",) * (len(seen.textures) > 1) + ("OVER",) * (how is self.lays)
            defines += ("FINE",) * sweep.fine + ("UNEVEN",) * sweep.uneven + ("CHUNKS",) * chunks
            program = self._program_for(defines)
            program.draw(_values(span, count), [seen.textures[0], ways, *seen.textures[1:]])
            if not last:
                seen = between
        ways.release()

    def _program_for(self, defines: tuple[str, ...]) -> FullscreenProgram:
        if defines not in self._programs:
            samplers = ["snapshot", "paths"] + ["covered"] * ("COVERED" in defines)
            self._programs[defines] = FullscreenProgram(
                self._ctx, "motion_sweep/motion_sweep", _SWEEP, samplers, defines
            )
        return self._programs[defines]

    def release(self) -> None:
        """Free everything."""
        for program in self._programs.values():
            program.release()
        self._programs.clear()


def _values(sweep: Sweep, count: int) -> dict[str, object]:
    paths, span = sweep.paths, sweep.span
    x, y, width, height = sweep.filled
    return {
        "filled": (x, y, x + width, y + height),
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


def _interpolate(texture: moderngl.Texture) -> None:
    """Read it with linear interpolation, beyond its edges as at these."""
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    texture.repeat_x = texture.repeat_y = False


def _steps(way: float) -> tuple[int, ...]:
    """Places on either side of the middle, and the chunks of each further step, for ways of so many
    pixels."""
    if way <= _ONE_STEP:
        return (_places(way),)
    number = 2 if way <= _TWO_STEPS else 3
    # As many reads in each, of an odd number of places.
    places = max(round(0.5 * (way ** (1.0 / number) - 1.0)), 1)
    parts = way / np.sqrt((2 * places + 1) ** 2 - 1.0)
    if number == 2:
        return places, int(np.ceil(parts))
    chunks = int(np.ceil(np.sqrt(parts)))
    return places, chunks, int(np.ceil(parts / chunks))


def _places(way: float) -> int:
    """On either side of the middle, for ways of so many pixels (``motion_sweep.frag``)."""
    return max(int(np.ceil(0.5 * (np.sqrt(way**2 + 1.0) - 1.0) - 1e-6)), 1)
