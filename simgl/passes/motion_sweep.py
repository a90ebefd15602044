"""Sweep: what pixels see over an exposure, from a snapshot of its middle and the ways across it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

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
# The longest way of what accelerates, along which it is swept pixel by pixel [px]. Each pixel of it
# takes twice as long as of an even way, but each part more draws over the snapshot again.
_UNEVEN = 12.0
# The same where rows begin at times of their own [px].
_LONGEST_UNEVEN = 160.0
# Pixels that interpolation reads around a snapshot, and those of the last place in part.
_MORE = 3
# Number of the spare target that adds up parts.
_TOTAL = 2


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
    lights : number of the snapshots, which show equal parts of an exposure in their own light
    edges : whether it shows edges, which are to stay as sharp as they are across the motion
    """

    paths: ImagePaths
    size: tuple[int, int]
    filled: Box
    margin: tuple[int, int] = (0, 0)
    target_size: tuple[int, int]
    span: Span = Span()
    share: float = 1.0
    lights: int = 1
    edges: bool = False

    @property
    def area(self) -> Box:
        """Of the target, where it may go."""
        return self.area_of(self.span)

    def area_of(self, span: Span) -> Box:
        """The same at times of a part of the exposure."""
        low, high = self.paths.box_of(span.first - span.moment, span.last - span.moment)
        x, y, width, height = self.filled
        if self.filled == (0, 0, *self.size):
            return 0, 0, *self.target_size
        start, extent = np.array([x, y]) - self.margin, np.array([width, height])
        corner = np.floor(start + low).astype(int) - _MORE
        end = np.ceil(start + extent + high).astype(int) + _MORE
        (x0, y0), (x1, y1) = (np.clip(one, 0, self.target_size).tolist() for one in (corner, end))
        return x0, y0, max(x1 - x0, 0), max(y1 - y0, 0)

    @property
    def fine(self) -> bool:
        """Whether places between pixels are told from four of them."""
        share = min(self.span.last - self.span.first, 1.0 / self.lights)
        return self.edges and share * max(self.paths.reach) <= _ONE_STEP

    @cached_property
    def parts(self) -> tuple[SweepPart, ...]:
        """Of the exposure, in each of which it moves evenly, or not far.

        Where it accelerates it would have to be read pixel by pixel.
        """
        edges = np.linspace(-0.5, 0.5, self.lights + 1)[1:-1].tolist()
        within = [edge for edge in edges if self.span.first < edge < self.span.last]
        parts: list[SweepPart] = []
        for first, last in pairwise([self.span.first, *within, self.span.last]):
            light = sum(edge < 0.5 * (first + last) for edge in edges)
            for one in self._divided(replace(self.span, first=first, last=last), light):
                if parts and parts[-1].uneven and one.uneven and parts[-1].light == light:
                    # Of a way that turns back just there, halves lie on each other.
                    both = self._part(replace(one.span, first=parts[-1].span.first), light)
                    if both.is_short:
                        parts[-1] = both
                        continue
                parts.append(one)
        return tuple(parts)

    def _divided(self, span: Span, light: int) -> Iterator[SweepPart]:
        one = self._part(span, light)
        if one.is_short or not one.paths.uneven:
            yield one
            return
        middle = 0.5 * (span.first + span.last)
        yield from self._divided(replace(span, last=middle), light)
        yield from self._divided(replace(span, first=middle), light)

    def _part(self, span: Span, light: int) -> SweepPart:
        # Each row that has its own time sees an exposure time of it, from its own start on.
        if span.row_rate:
            return SweepPart(span=span, paths=self.paths, light=light)
        first, last = span.first - span.moment, span.last - span.moment
        return SweepPart(span=span, paths=self.paths.within(first, last), light=light)

    @property
    def read(self) -> Box:
        """What is read of the snapshot."""
        return self.read_by(self.parts[0]) if len(self.parts) == 1 else self._around(self.span)

    def read_by(self, part: SweepPart, step: int = 0) -> Box:
        """What a step reads of the snapshot, or of what the step before has made of it."""
        if step == len(part.steps) - 1:
            return self._around(part.span)
        x, y = part.reach(step)
        return grown(self.filled, (2 * x, 2 * y), self.size)

    def _around(self, span: Span) -> Box:
        low, high = self.paths.box_of(span.first - span.moment, span.last - span.moment)
        x, y = (int(way) + 2 * _MORE for way in np.ceil(high - low).tolist())
        return grown(self.filled, (x, y), self.size)


@dataclass(frozen=True, kw_only=True, eq=False)
class SweepPart:
    """A part of an exposure that is swept by itself.

    paths : from its middle on, in all of it
    light : number of its snapshot
    """

    span: Span
    paths: ImagePaths
    light: int = 0

    @cached_property
    def uneven(self) -> bool:
        """Whether what it shows accelerates, and goes not too far to be swept pixel by pixel."""
        return self.paths.uneven and max(self.paths.reach) <= _LONGEST_UNEVEN

    @property
    def off_centre(self) -> bool:
        """Whether it is another part than that around the snapshot's moment."""
        return self.span.first + self.span.last != 2.0 * self.span.moment

    @property
    def is_short(self) -> bool:
        """Whether it is swept as one though what it shows accelerates."""
        return max(self.paths.reach) <= _UNEVEN or self.span.row_rate != 0.0

    @cached_property
    def steps(self) -> tuple[int, ...]:
        """Places on either side of the middle in the first step, and the chunks of each further."""
        way = max(self.paths.reach)
        return (_places(way),) if self.uneven else _steps(way)

    def share(self, step: int) -> float:
        """Of the part, over which a step sweeps."""
        return 1.0 / float(np.prod(self.steps[step + 1 :], dtype=np.float64))

    def reach(self, step: int) -> tuple[int, int]:
        """How far a step goes from where it is, along x and y [px]."""
        x, y = (int(np.ceil(0.5 * self.share(step) * way)) + _MORE for way in self.paths.reach)
        return x, y


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
        self,
        sweep: Sweep,
        snapshots: Sequence[ImageTarget],
        target: moderngl.Framebuffer,
        spare: Spare,
    ) -> None:
        """Fill the area of a sweep.

        snapshots : ``sweep.lights`` of them; spare : makes other targets like them, by a number
        """
        self._draw(sweep, snapshots, target, self.fills, spare)

    def add(
        self,
        sweep: Sweep,
        snapshots: Sequence[ImageTarget],
        target: moderngl.Framebuffer,
        spare: Spare,
    ) -> None:
        """Add to what a target holds there."""
        self._draw(sweep, snapshots, target, self.adds, spare)

    def lay_over(
        self,
        sweep: Sweep,
        snapshots: Sequence[ImageTarget],
        target: moderngl.Framebuffer,
        spare: Spare,
    ) -> None:
        """Lay snapshots over it: of radiance, and the covered share of each pixel."""
        self._draw(sweep, snapshots, target, self.lays, spare)

    def _draw(
        self,
        sweep: Sweep,
        snapshots: Sequence[ImageTarget],
        target: moderngl.Framebuffer,
        state: State,
        spare: Spare,
    ) -> None:
        if len(sweep.parts) == 1:
            self._draw_part(sweep, sweep.parts[0], snapshots[0], target, state, spare)
        elif state is self.lays:
            # What is behind is hidden by all parts together.
            summed = replace(sweep, margin=(0, 0), target_size=sweep.size)
            total = spare(_TOTAL)
            total.framebuffer.clear(viewport=summed.area)
            self._add_parts(summed, snapshots, total.framebuffer, spare)
            still = replace(
                sweep, paths=sweep.paths.still, filled=summed.area, lights=1, edges=False
            )
            self._draw_part(still, still.parts[0], total, target, state, spare)
        else:
            if state is self.fills:
                target.clear(viewport=sweep.area)
            self._add_parts(sweep, snapshots, target, spare)

    def _add_parts(
        self,
        sweep: Sweep,
        snapshots: Sequence[ImageTarget],
        target: moderngl.Framebuffer,
        spare: Spare,
    ) -> None:
        for part in sweep.parts:
            self._draw_part(sweep, part, snapshots[part.light], target, self.adds, spare)

    def _draw_part(
        self,
        sweep: Sweep,
        part: SweepPart,
        snapshot: ImageTarget,
        target: moderngl.Framebuffer,
        state: State,
        spare: Spare,
    ) -> None:
        seen = snapshot
        for step, count in enumerate(part.steps):
            last = step == len(part.steps) - 1
            if last:
                into, area, how = target, sweep.area_of(part.span), state
                swept = replace(sweep, span=part.span)
            else:
                # In a snapshot of its own, over a share of the part.
                between = spare(step % 2)
                between.framebuffer.clear(viewport=sweep.read_by(part, step + 1))
                share = part.share(step)
                half = Span(first=-0.5 * share, last=0.5 * share)
                swept = replace(
                    sweep, paths=part.paths, margin=(0, 0), span=half, share=1.0 / share
                )
                area = grown(sweep.filled, part.reach(step), sweep.size)
                into, how = between.framebuffer, self.fills
            how.apply(self._ctx, into, (0, 0, *into.size), area)
            for texture in seen.textures:
                _interpolate(texture)
            defines = ("COVERED",) * (len(seen.textures) > 1) + ("OVER",) * (how is self.lays)
            defines += ("FINE",) * sweep.fine + ("OFF_CENTRE",) * (sweep.fine and part.off_centre)
            defines += ("UNEVEN",) * part.uneven + ("CHUNKS",) * (step > 0)
            ways = table_texture(self._ctx, swept.paths.nodes)
            _interpolate(ways)
            program = self._program_for(defines)
            program.draw(_values(swept, count), [seen.textures[0], ways, *seen.textures[1:]])
            ways.release()
            if not last:
                seen = between

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
