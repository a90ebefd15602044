"""What is drawn of a scene that moves while the shutter is open."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from simgl.arrays import Array
from simgl.camera.camera import Camera
from simgl.camera.rolling_shutter import (
    LEAN,
    MAX_PARTS,
    PARTS_PER_PIXEL,
    duration,
    instants,
    lean_and_blur,
    moments,
    parts,
    read_out,
    row_shares,
)
from simgl.scene.state import SceneState
from simgl.view.image_motion import background_motion, spacecraft_motion, turn
from simgl.view.raster_tiles import rows_of
from simgl.view.row_clock import RowClock, camera_from_body

# Turn of a body, a joint or the camera against the Sun that is lit as at its middle [rad]. The
# light then comes from within half a degree of where it should, as from the Sun's own disc.
LARGEST_TURN = float(np.radians(1.0))


@dataclass(frozen=True, kw_only=True, eq=False)
class ExposurePart:
    """Spacecraft in some rows of the image at one moment of each row's exposure.

    state : at the middle row's time
    shares : (height,) of each row's exposure
    rows : None where all rows see the state itself
    before, after : states at the times of the first and the last row's outer edges
    """

    state: SceneState
    shares: Array
    rows: RowClock | None = None
    before: SceneState | None = None
    after: SceneState | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class MovingScene:
    """A scene over the exposure of one camera's image.

    at : the scene at a time from the epoch [s], with the camera as it is used
    instants : at which what is behind the spacecraft is drawn [s]; none where the epoch is enough
    moments : of each row's exposure at which spacecraft are drawn [s]
    rows : of the parts of the image that are drawn apart; none where rows need not be told apart
    """

    camera: Camera
    at: Callable[[float], SceneState]
    instants: Array
    moments: Array
    rows: tuple[RowClock, ...]

    def parts(self) -> Iterator[ExposurePart]:
        """What is drawn of the spacecraft, one after the other."""
        d, share = self.camera.detector, 1.0 / len(self.moments)
        for moment in self.moments.tolist():
            if not self.rows:
                yield ExposurePart(state=self.at(moment), shares=np.full(d.height, share))
            for clock in self.rows:
                middle = (clock.middle - 0.5 * d.height) * d.row_time + moment
                half = 0.5 * (clock.end - clock.first) * d.row_time
                shares = np.zeros(d.height)
                shares[clock.first : clock.end] = share
                yield ExposurePart(
                    state=self.at(middle),
                    shares=shares,
                    rows=clock,
                    before=self.at(middle - half),
                    after=self.at(middle + half),
                )

    def behind(self) -> Iterator[tuple[SceneState, Array]]:
        """What is drawn behind them: states, and the weight of each in each row (height,)."""
        if not len(self.instants):
            yield self.at(0.0), np.ones(self.camera.detector.height)
            return
        shares = row_shares(self.camera, len(self.instants) - 1)
        for offset, share in zip(self.instants.tolist(), shares, strict=True):
            yield self.at(offset), share


def moving_scene(
    state: SceneState, name: str, during: Callable[[int], SceneState]
) -> MovingScene | None:
    """The scene over the exposure of a camera; None where nothing moves visibly.

    during : the scene at other epochs [TAI ns]
    """
    camera = state.cameras[name].camera

    def at(offset: float) -> SceneState:
        moved = during(state.tai_ns + round(offset * 1e9))
        # The exposure time may have been chosen for this image alone.
        placed = replace(moved.cameras[name], camera=camera)
        return replace(moved, cameras={**moved.cameras, name: placed})

    half = 0.5 * duration(camera)
    # On either side of the middle: a motion that turns back shows none from end to end.
    ends = at(-half), at(half)
    motion_behind = sum(background_motion(state, end, name) for end in ends)
    motion = sum(spacecraft_motion(state, end, name) for end in ends)
    behind = parts(camera, motion_behind)
    lean, blur = lean_and_blur(camera, motion)
    within = moments(camera, blur)
    if not behind and len(within) == 1 and lean <= LEAN:
        return None
    rows: tuple[RowClock, ...] = ()
    if lean > LEAN:
        turned = sum(turn(state, end, name) for end in ends) * read_out(camera) / duration(camera)
        rows = _rows(camera, _rows_used((state, *ends), name), turned, lean)
    return MovingScene(
        camera=camera,
        at=at,
        instants=instants(camera, behind) if behind else np.zeros(0),
        moments=within,
        rows=rows,
    )


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


def _rows(
    camera: Camera, used: tuple[int, int], turned: float, lean: float
) -> tuple[RowClock, ...]:
    """The rows in parts, in each of which nothing turns by more than ``LARGEST_TURN``.

    used : rows that spacecraft may touch
    turned, lean : over all rows of the image [rad, px]; there are no more parts than half pixels of
        motion
    """
    first, end = used
    share = (end - first) / camera.detector.height
    largest = min(np.ceil(PARTS_PER_PIXEL * lean), MAX_PARTS, end - first)
    count = int(np.clip(np.ceil(turned * share / LARGEST_TURN), 1, largest))
    edges = np.round(np.linspace(first, end, count + 1)).astype(int)
    return tuple(RowClock(low, high) for low, high in pairwise(edges.tolist()))
