"""What is drawn of a scene that moves while the shutter is open.

Snapshots, each of which is swept along its image motion over the part of the exposure
around it: one where the light on all spacecraft stays as it is, which is nearly always.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from itertools import pairwise
from math import ceil

import numpy as np

from simgl.arrays import Array
from simgl.camera.camera import Camera
from simgl.camera.rolling_shutter import (
    BLUR,
    LEAN,
    MAX_PARTS,
    PARTS_PER_PIXEL,
    duration,
    lean_and_blur,
    read_out,
)
from simgl.scene.state import CameraState, SceneState
from simgl.view.depth_layers import depth_layers
from simgl.view.hulls_in_view import rows_of
from simgl.view.image_motion import (
    background_motion,
    spacecraft_motion,
    turn_of_bodies,
    turn_of_camera,
    turn_of_joints,
    ways_behind,
)
from simgl.view.mean_sunlight import with_mean_sunlight
from simgl.view.row_clock import RowClock, camera_from_body
from simgl.view.snapshot_count import (
    LARGEST_TURN,
    LONGEST_WAY,
    count_behind,
    outline,
    snapshot_count,
)

# Turn of a body whose rows have sunlight and its shadows at their own times: only the light between
# its surfaces is that of the middle, in the first and the last row off by the sine of half the turn
# at most, a share of 0.07 [rad]. Places of rows do not depend on it.
LARGEST_TURN_IN_ROWS = 2.0 * float(np.arcsin(0.07))
# And of the camera, for how its turn is told (``row_clock``).
LARGEST_TURN_OF_CAMERA = float(np.radians(20.0))
# How far sunlight may lean against the shadow maps that it is looked up in [rad].
LARGEST_LEAN = float(np.radians(10.0))
# How far what passes before something else that moves, too, goes while the covered share of its
# pixels hides that [px]: about where their edges cross, the product of two means is wrong by up to
# a quarter. And the largest number of such times.
_LAID_STEP, _MAX_LAID = 3.0, 24
# Steps in which the snapshot grows around the image, so that its textures last [px].
_MARGIN_STEP = 16


@dataclass(frozen=True, kw_only=True, eq=False)
class ExposurePart:
    """Spacecraft in some rows of the image, around one moment of each row's exposure.

    name : of the camera
    state : at the middle row's time
    first, last : states at the start and the end of what the rows see
    half_span : from the middle to these [s]
    exposure_time : of the part of the rows' exposure that is seen [s]
    row_time : from a row to the next; 0 where all rows see the state itself [s]
    rows : None where all rows see the state itself
    before, after : states at the times of the first and the last row's outer edges
    shadows : the state that the shadow maps are drawn for; None for the part's own
    shadow_turn : spacecraft turn by so much against the Sun between that and what is seen [rad]
    turn_while_open : and by so much while a row is exposed [rad]
    light_parts : of its time, for each of which lobes are averaged apart
    names : of the spacecraft that are drawn; None for all
    """

    name: str
    state: SceneState
    first: SceneState
    last: SceneState
    half_span: float
    exposure_time: float
    row_time: float = 0.0
    rows: RowClock | None = None
    before: SceneState | None = None
    after: SceneState | None = None
    shadows: SceneState | None = None
    shadow_turn: float = 0.0
    turn_while_open: float = 0.0
    light_parts: int = 1
    names: frozenset[str] | None = None

    @property
    def blurs(self) -> bool:
        """Whether anything moves within the exposure of a row."""
        return self.first is not self.state

    def camera_of(self, state: SceneState) -> CameraState:
        """The camera in one of the states."""
        return state.cameras[self.name]

    def row_times(self, rows: Array) -> Array:
        """When row coordinates (n,) are seen, from the middle on, in units of ``half_span``."""
        if self.rows is None:
            return np.zeros(len(rows))
        return np.asarray((rows - self.rows.middle) * (self.row_time / self.half_span))


@dataclass(frozen=True, kw_only=True, eq=False)
class BackgroundPart:
    """What is behind spacecraft around one moment.

    state : at the moment
    first, last : at the start and the end of what it stands for
    moment : from the epoch on [s]
    half_span : from the moment to the ends [s]
    exposure_time : [s]
    """

    state: SceneState
    first: SceneState
    last: SceneState
    moment: float
    half_span: float
    exposure_time: float


@dataclass(frozen=True, kw_only=True, eq=False)
class MovingScene:
    """A scene over the exposure of one camera's image.

    camera : of the image
    drawn : the same, for spacecraft; with a margin around the image, out of which they move into it
        while a row is exposed
    drawn_behind : the same, for what is behind them, whose rows see other parts of it, too
    at : the scene at a time from the epoch [s], with ``drawn`` for its camera
    count : of the snapshots of spacecraft
    light_parts : of the time of each, for each of which lobes are averaged apart
    blurs : whether these are swept; whether what is behind them is, and from how many snapshots
    rows : of the parts of the image that are drawn apart; none where rows need not be told apart
    turned : how far spacecraft turn against the Sun during all of it [rad]
    names : of the spacecraft; None for all
    layers : the scenes of those that pass before one another, the farthest first, with as many
        snapshots as each needs; none where nothing does
    laid_count : in so many equal parts of the exposure layers are laid over one another
    """

    camera: Camera
    drawn: Camera
    drawn_behind: Camera
    at: Callable[[float], SceneState]
    count: int
    light_parts: int
    blurs: bool
    behind_count: int
    rows: tuple[RowClock, ...]
    turned: float
    names: frozenset[str] | None = None
    layers: tuple[MovingScene, ...] = ()
    laid_count: int = 1

    def at_times_of(self, at: Callable[[float], SceneState]) -> MovingScene:
        """The same with other states at its times."""
        return replace(self, at=at, layers=tuple(replace(one, at=at) for one in self.layers))

    @property
    def spans(self) -> tuple[tuple[Fraction, Fraction], ...]:
        """Parts of the exposure from 0 to 1, in each of which there is one snapshot of each layer,
        and layers are laid over one another once."""
        counts = {one.count for one in self.layers or (self,)}
        edges = sorted({Fraction(k, count) for count in counts for k in range(count + 1)})
        spans = []
        for first, last in pairwise(edges):
            parts = ceil((last - first) * self.laid_count)
            step = (last - first) / parts
            spans += [(first + k * step, first + (k + 1) * step) for k in range(parts)]
        return tuple(spans)

    def margin_of(self, drawn: Camera) -> tuple[int, int]:
        """Columns and rows of one of the two around the image [px]."""
        inner, outer = self.camera.detector, drawn.detector
        return (outer.width - inner.width) // 2, (outer.height - inner.height) // 2

    def snapshots(self) -> Iterator[tuple[ExposurePart, ...]]:
        """What is drawn of the spacecraft for each snapshot, one part beside the other."""
        length = self.camera.exposure_time / self.count
        for number in range(self.count):
            moment = (number + 0.5 - 0.5 * self.count) * length
            yield tuple(self._part(moment, length, clock) for clock in self.rows or (None,))

    def _part(self, moment: float, length: float, clock: RowClock | None) -> ExposurePart:
        row_time = self.camera.detector.row_time
        middle, half = moment, 0.0
        if clock is not None:
            middle += (clock.middle - 0.5 * self.drawn.detector.height) * row_time
            half = 0.5 * (clock.end - clock.first) * row_time
        span = half + 0.5 * length
        state = with_mean_sunlight(self.at(middle), self.camera.name, self.at, middle, length)
        shadows, shadow_turn = self._shadows(state, middle, span if self.blurs else half)
        return ExposurePart(
            name=self.camera.name,
            state=state,
            first=self.at(middle - span) if self.blurs else state,
            last=self.at(middle + span) if self.blurs else state,
            half_span=span,
            exposure_time=length,
            row_time=0.0 if clock is None else row_time,
            rows=clock,
            before=None if clock is None else self.at(middle - half),
            after=None if clock is None else self.at(middle + half),
            shadows=shadows,
            shadow_turn=shadow_turn,
            turn_while_open=self.turned * length / duration(self.camera),
            light_parts=self.light_parts,
            names=self.names,
        )

    def _shadows(
        self, state: SceneState, moment: float, half: float
    ) -> tuple[SceneState | None, float]:
        """The state that shadow maps for so much time around a moment are drawn for, and the turn
        from there.

        Maps cost more than all else where a spacecraft turns: parts that turn by little share them.

        state : at the moment
        half : of the time that is seen
        """
        length = duration(self.camera)
        in_part = 2.0 * half / length * self.turned
        if self.count == 1 and len(self.rows) < 2:
            return (state if in_part > 0.0 else None), 0.5 * in_part
        if not self.rows:
            # Snapshots one after the other, so many for each map.
            together = max(int(2.0 * LARGEST_LEAN / max(in_part, 1e-9) + 1e-6), 1)
            together = int(np.ceil(self.count / np.ceil(self.count / together)))
            first = together * int((moment / length + 0.5) * self.count / together)
            end = min(first + together, self.count)
            middle = (0.5 * (first + end) / self.count - 0.5) * length
            return self.at(middle), 0.5 * together * in_part
        step = max(2.0 * LARGEST_LEAN - in_part, LARGEST_TURN)
        count = max(int(np.ceil(self.turned / step)), 1)
        place = np.clip(np.floor((moment / length + 0.5) * count), 0, count - 1)
        middle = ((place + 0.5) / count - 0.5) * length
        return self.at(middle), 0.5 * (self.turned / count + in_part)

    def behind(self) -> Iterator[BackgroundPart]:
        """What is swept behind them; none where the epoch is enough."""
        half = 0.5 * duration(self.camera) / max(self.behind_count, 1)
        for number in range(self.behind_count):
            moment = (2 * number + 1 - self.behind_count) * half
            state, first, last = (
                _seen_by(self.at(time), self.camera.name, self.drawn_behind)
                for time in (moment, moment - half, moment + half)
            )
            yield BackgroundPart(
                state=state,
                first=first,
                last=last,
                moment=moment,
                half_span=half,
                exposure_time=self.camera.exposure_time,
            )


def moving_scene(
    state: SceneState, name: str, during: Callable[[int], SceneState]
) -> MovingScene | None:
    """The scene over the exposure of a camera; None where nothing moves visibly.

    during : the scene at other epochs [TAI ns]
    """
    camera = state.cameras[name].camera

    def at(offset: float, drawn: Camera = camera) -> SceneState:
        # The exposure time may have been chosen for this image alone.
        return _seen_by(during(state.tai_ns + round(offset * 1e9)), name, drawn)

    half = 0.5 * duration(camera)
    # On either side of the middle: a motion that turns back shows none from end to end.
    ends = at(-half), at(half)
    behind = sum(background_motion(state, end, name) for end in ends)
    lean_behind, blur_behind = lean_and_blur(camera, behind)
    moves_behind = lean_behind > LEAN or blur_behind > BLUR
    lean, blur = lean_and_blur(camera, sum(spacecraft_motion(state, end, name) for end in ends))
    if not moves_behind and lean <= LEAN and blur <= BLUR:
        return None
    blurs, exposed = blur > BLUR, camera.exposure_time / duration(camera)
    times: tuple[SceneState, ...] = (ends[0], state, ends[1])
    everything = frozenset(state.bodies)
    split: tuple[tuple[frozenset[str], int, int], ...] = ((everything, 1, 1),)
    laid_count = 1
    if blurs:
        # Of more than half a turn the ends tell no more.
        times = ends[0], at(-0.5 * half), state, at(0.5 * half), ends[1]
        by_depth = depth_layers(times, name, exposed)
        split = tuple(
            (names, *snapshot_count(times, name, exposed, blur, rows=lean > LEAN, names=names))
            for names in by_depth.names
        )
        laid_count = int(np.clip(np.ceil(by_depth.both_move / _LAID_STEP), 1, _MAX_LAID))
    turned = sum(turn_of_bodies(one, other) for one, other in pairwise(times))
    around = camera
    if blurs or moves_behind:
        ways = np.zeros(2)
        if blurs:
            fewest = min(count for _, count, _ in split)
            ways = _ways_in((ends[0], state, ends[1]), name, exposed / fewest, turned)
        if moves_behind:
            ways = np.maximum(ways, ways_behind(ends, name))
        around = _with_margin(camera, np.minimum(ways, max(blur, behind)))
    drawn = around if blurs else camera
    one = MovingScene(
        camera=camera,
        drawn=drawn,
        drawn_behind=around,
        at=partial(at, drawn=drawn),
        count=max(count for _, count, _ in split),
        light_parts=split[0][2],
        blurs=blurs,
        behind_count=count_behind((ends[0], state, ends[1]), name, behind) * moves_behind,
        rows=_row_clocks(state, ends, name, drawn, lean) if lean > LEAN else (),
        turned=turned,
    )
    if len(split) == 1:
        return one
    layers = tuple(
        replace(one, names=names, count=count, light_parts=light_parts)
        for names, count, light_parts in split
    )
    return replace(one, layers=layers, laid_count=laid_count)


def _row_clocks(
    state: SceneState, ends: tuple[SceneState, SceneState], name: str, drawn: Camera, lean: float
) -> tuple[RowClock, ...]:
    """The rows that are drawn together, of a rolling shutter whose rows see a scene move by lean.

    ends : the scene at the start and the end of the exposure
    """
    camera = state.cameras[name].camera
    turns = sum(
        max(
            turn_of_bodies(state, end) / LARGEST_TURN_IN_ROWS,
            turn_of_joints(state, end) / LARGEST_TURN,
            turn_of_camera(state, end, name) / LARGEST_TURN_OF_CAMERA,
        )
        for end in ends
    )
    states = tuple(_seen_by(one, name, drawn) for one in (state, *ends))
    turns *= read_out(camera) / duration(camera)
    return _rows(drawn, _rows_used(states, name), turns, lean)


def _seen_by(state: SceneState, name: str, camera: Camera) -> SceneState:
    placed = replace(state.cameras[name], camera=camera)
    return replace(state, cameras={**state.cameras, name: placed})


def _with_margin(camera: Camera, ways: Array) -> Camera:
    """A camera that sees beyond the image as far as what moves by so much comes into it [px].

    A lens that distorts sees no farther: it may image nothing sensible there.
    """
    if not camera.is_pinhole:
        return camera
    # With a little more for interpolation.
    reach = np.where(ways > BLUR, np.minimum(0.5 * ways, 0.5 * LONGEST_WAY) + 2.0, 0.0)
    x, y = (_MARGIN_STEP * int(np.ceil(one / _MARGIN_STEP)) for one in reach.tolist())
    d = camera.detector
    return replace(camera, detector=replace(d, width=d.width + 2 * x, height=d.height + 2 * y))


def _ways_in(
    states: tuple[SceneState, SceneState, SceneState], name: str, share: float, turned: float
) -> Array:
    """(2,) how far along x and y spacecraft move that reach beyond the image [px]; 0 for none.

    states : from the start to the end
    share : of that time in which they do so
    turned : in all of it [rad]
    """
    camera = states[0].cameras[name].camera
    size = np.array([camera.detector.width, camera.detector.height])
    ways = np.zeros(2)
    for body in states[1].bodies:
        outlines = [outline(state, name, body) for state in states]
        if not np.isfinite(outlines).all():
            return np.full(2, np.inf)
        first, middle, last = outlines
        if np.any((middle < 0.0) | (middle > size)):
            way, bend = np.abs(last - first), np.abs(last + first - 2.0 * middle)
            # Where they are fastest.
            fastest = share * (way + (2.0 - share) * bend)
            ways = np.maximum(ways, fastest.max(axis=0))
    if turned > 0.5 * np.pi:
        # Where they turn far, either axis may be that along which they are the fastest.
        return np.full(2, ways.max())
    # An arc is longer than its chord.
    return ways / float(np.sinc(turned / (2.0 * np.pi)))


def _rows_used(states: tuple[SceneState, ...], name: str) -> tuple[int, int]:
    """First and end of the rows that spacecraft may touch."""
    camera = states[0].cameras[name].camera
    height = camera.detector.height
    if not camera.is_pinhole:
        return 0, height
    low, high = [], []
    for state in states:
        for body in state.bodies.values():
            matrix = camera_from_body(state.cameras[name], body)
            hull = body.model.posed_mesh.hull @ matrix[:3, :3].T + matrix[:3, 3]
            if (between := rows_of(hull, camera)) is not None:
                low.append(between[0])
                high.append(between[1])
    # With a little more for what turns between the states.
    margin = 2.0 + 0.1 * (max(high, default=0.0) - min(low, default=0.0))
    first = int(np.clip(np.floor(min(low, default=0.0) - margin), 0, height - 1))
    end = int(np.clip(np.ceil(max(high, default=0.0) + margin), first + 1, height))
    return first, end


def _rows(camera: Camera, used: tuple[int, int], turns: float, lean: float) -> tuple[RowClock, ...]:
    """The rows in parts, in each of which nothing turns too far.

    used : rows that spacecraft may touch
    turns : in so many steps all rows of the image may be drawn
    lean : over all rows of the image [px]; there are no more parts than half pixels of motion
    """
    first, end = used
    share = (end - first) / camera.detector.height
    largest = min(np.ceil(PARTS_PER_PIXEL * lean), MAX_PARTS, end - first)
    count = int(np.clip(np.ceil(turns * share), 1, largest))
    edges = np.round(np.linspace(first, end, count + 1)).astype(int)
    return tuple(RowClock(low, high) for low, high in pairwise(edges.tolist()))
