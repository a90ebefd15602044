"""What is drawn of a moving scene: the snapshots of its spacecraft, in layers, and those behind."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from simgl.camera.camera import Camera
from simgl.camera.pixel_ramp import SHARP, Ramps
from simgl.scene.lamps import LampState
from simgl.scene.state import SceneState
from simgl.view.exposure_parts import BackgroundPart, ExposurePart, MovingScene
from simgl.view.frame_view import FrameView, behind_spacecraft
from simgl.view.image_paths import Box, ImagePaths, background_paths, spacecraft_paths
from simgl.view.raster_tiles import RasterTile

# Difference of motions in which what lies before something else goes along with it [px].
_TOGETHER = 0.25


@dataclass(frozen=True, kw_only=True, eq=False)
class DrawnTile:
    """A tile of a view through one pinhole.

    rows : of the image that it is seen in; None for all
    """

    view: FrameView
    tile: RasterTile
    rows: tuple[int, int] | None


@dataclass(frozen=True, kw_only=True, eq=False)
class Layer:
    """Tiles that are swept as one snapshot.

    filled : x, y, width, height that they may touch [px]
    paths : None where they are not swept
    small : spacecraft of a few pixels alone
    light_parts : of the time for which it stands, each with light of its own
    """

    tiles: tuple[DrawnTile, ...]
    filled: Box
    paths: ImagePaths | None = None
    small: bool = False
    light_parts: int = 1

    def goes_with(self, paths: ImagePaths) -> bool:
        """Whether it moves as what has these paths does, in one light."""
        if self.paths is None or self.light_parts > 1:
            return False
        return self.paths.differ(paths) < _TOGETHER


@dataclass(frozen=True, kw_only=True, eq=False)
class SweptBackground:
    """What is behind spacecraft around one moment, drawn with the margin.

    paths : None where it stands still, and is drawn without
    """

    view: FrameView
    part: BackgroundPart | None = None
    paths: ImagePaths | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class MovingViews:
    """A scene over an exposure, and what is drawn of its parts.

    ramps : of each band between neighbouring pixels [px]
    """

    scene: MovingScene
    view_of: Callable[[ExposurePart], FrameView]
    ramps: Ramps = SHARP

    def lit_by(self, lamps_of: Callable[[SceneState], tuple[LampState, ...]]) -> MovingViews:
        """The same with other lamps."""
        at = self.scene.at

        def lit(offset: float) -> SceneState:
            state = at(offset)
            return replace(state, lamps=lamps_of(state))

        return replace(self, scene=self.scene.at_times_of(lit))

    @property
    def camera(self) -> Camera:
        """Of the image."""
        return self.scene.camera

    @property
    def by_depth(self) -> tuple[MovingViews, ...]:
        """Of spacecraft that pass before one another, the farthest first; of all where none do."""
        return tuple(replace(self, scene=one) for one in self.scene.layers or (self.scene,))

    def snapshots(self) -> Iterator[tuple[tuple[ExposurePart, FrameView], ...]]:
        """The parts of each snapshot of spacecraft; each for an equal part of the exposure."""
        for parts in self.scene.snapshots():
            yield tuple((part, replace(self.view_of(part), ramps=self.ramps)) for part in parts)

    def behind(self, view: FrameView) -> Iterator[SweptBackground]:
        """What is behind them; their shares of each row's exposure add up to all of it.

        view : one of the spacecraft
        """
        scene = self.scene
        if not scene.behind_count:
            still = behind_spacecraft(replace(view, camera=scene.camera), scene.at(0.0))
            yield SweptBackground(view=still)
        for part in scene.behind():
            yield SweptBackground(
                view=behind_spacecraft(replace(view, camera=scene.drawn_behind), part.state),
                part=part,
                paths=background_paths(part, scene.camera.name),
            )

    def layers(self, snapshot: Sequence[tuple[ExposurePart, FrameView]]) -> list[Layer]:
        """Of one snapshot, the farthest first.

        Where it is drawn in parts side by side they are one layer: a snapshot that is swept has no
        seams.
        """
        tiles = [
            DrawnTile(view=seen, tile=tile, rows=_rows_of(part))
            for part, view in snapshot
            for seen in view.pinholes
            for tile in seen.tiles
        ]
        if not tiles:
            return []
        together = len(snapshot) > 1 or len(snapshot[0][1].pinholes) > 1
        groups = [tiles] if together else [[one] for one in tiles]
        return [self._layer(group, [part for part, _ in snapshot]) for group in groups]

    def _layer(self, tiles: Sequence[DrawnTile], parts: Sequence[ExposurePart]) -> Layer:
        d = self.scene.drawn.detector
        # Ramps bring light to the next pixel.
        filled = _touched([one.tile for one in tiles], 1, (d.width, d.height))
        if any(one.view.field is not None for one in tiles):
            filled = 0, 0, d.width, d.height
        if not self.scene.blurs:
            return Layer(tiles=tuple(tiles), filled=filled)
        names = sorted({each.name for one in tiles for each in one.tile.spacecraft})
        paths = spacecraft_paths(parts, names, filled)
        small = all(one.tile.window is not None for one in tiles)
        if small:
            tiles, paths = self._softened(tiles, paths)
        return Layer(
            tiles=tuple(tiles),
            filled=filled,
            paths=paths,
            small=small,
            light_parts=parts[0].light_parts,
        )

    def _softened(
        self, tiles: Sequence[DrawnTile], paths: ImagePaths
    ) -> tuple[list[DrawnTile], ImagePaths]:
        """Small spacecraft with ramps between pixels, which are part of the motion.

        A pixel does not tell where in it a point is; two with a ramp between them do. Without, all
        of a streak would lie beside its place.
        """
        way = min(float(np.hypot(*paths.reach)), 1.0)
        ramps = np.maximum(self.ramps, way)
        more = float(np.mean(ramps**2 - np.square(self.ramps)))
        red, green, blue, infrared = ramps.tolist()
        soft = [
            replace(one, view=replace(one.view, ramps=(red, green, blue, infrared)))
            for one in tiles
        ]
        return soft, paths.shortened(more)


def _touched(tiles: Sequence[RasterTile], more: int, size: tuple[int, int]) -> Box:
    """x, y, width, height of the pixels of tiles, and so many around them [px]."""
    x0 = max(min(tile.x for tile in tiles) - more, 0)
    y0 = max(min(tile.y for tile in tiles) - more, 0)
    x1 = min(max(tile.x + tile.width for tile in tiles) + more, size[0])
    y1 = min(max(tile.y + tile.height for tile in tiles) + more, size[1])
    return x0, y0, x1 - x0, y1 - y0


def _rows_of(part: ExposurePart) -> tuple[int, int] | None:
    return None if part.rows is None else (part.rows.first, part.rows.end)
