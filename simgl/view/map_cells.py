"""What the tiles of an image touch of maps of the Earth, by the maps' cells."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from simgl.arrays import AnyArray, Array, IndexArray

# Of the map of clouds, 2048 rows high. Where a pixel is no larger, the texels around a place reach
# one away from it; the rest is for what rounding does to places.
_WEATHER_REACH = 1.02 * np.pi / 2048
# Texels of the map of shores around a place reach three pixels away from it, or a texel and a half
# of the whole map; farther than 39 km none is looked at [Earth radii].
_SHORE_PIXELS, _MIN_SHORE_REACH, _MAX_SHORE_REACH = 3.0, 6e-4, np.pi / 512
# Of the tiles of simgl/view/background_tiles.py [pixels].
_TILE_DIAGONAL = 22.7


@dataclass(frozen=True, kw_only=True, eq=False)
class MapCells:
    """What the cells of equirectangular maps hold.

    Sums (2, rows + 1, columns + 1) of the cells' corners: how many of those above and left of each
    are

    shores : not all open sea; not all inland
    clouds : not free of thin high cloud; not free of any cloud
    """

    shores: IndexArray
    clouds: IndexArray


@dataclass(frozen=True, kw_only=True, eq=False)
class MapBounds:
    """Where tiles lie on maps.

    low, high : (3, images, rows, columns) of their corners: latitude and longitude [rad], sine of
        latitude
    pixel : edge of a pixel on the ground [Earth radii]
    """

    low: Array
    high: Array
    pixel: Array

    def on_one_side(self, cells: MapCells) -> tuple[AnyArray, AnyArray]:
        """Whether tiles show open sea alone, and land alone."""
        reach = np.minimum(_SHORE_PIXELS * self.pixel + _MIN_SHORE_REACH, _MAX_SHORE_REACH)
        sea, land = self._untouched(cells.shores, reach)
        return sea, land

    def free_of_clouds(self, cells: MapCells, kind: int, off: Array) -> AnyArray:
        """Whether tiles of pixels no larger than a texel of the clouds' map show none.

        kind : which of ``MapCells.clouds``
        off : how far off the ground that is seen clouds before it may stand [Earth radii]
        """
        (free,) = self._untouched(cells.clouds[kind : kind + 1], off + _WEATHER_REACH)
        return free

    @cached_property
    def _bulge(self) -> Array:
        """By how much edges of tiles may reach past the parallels of their corners [rad].

        Great circles rise by sin(2 latitude) / 16 of the squared longitude between their ends. A
        plane through the camera cuts the ground in circles of at least 27 deg, which bend by
        cot(27 deg) / 8 of the squared way.
        """
        return (self.high[1] - self.low[1]) ** 2 / 16.0 + (_TILE_DIAGONAL * self.pixel) ** 2 / 4.0

    @cached_property
    def _corners(self) -> tuple[Array, Array, Array, Array, Array]:
        """Top, bottom, left and right of tiles as parts of half the maps' width, and how much more
        of it a way along a parallel is than along a meridian."""
        low, high = self.low / np.pi, self.high / np.pi
        shortest = np.sqrt(np.maximum(1.0 - np.maximum(self.high[2], -self.low[2]) ** 2, 1e-6))
        return 0.5 - high[0], 0.5 - low[0], 1.0 + low[1], 1.0 + high[1], 1.0 / shortest

    def _untouched(self, sums: IndexArray, margin: Array) -> AnyArray:
        """(kinds, images, rows, columns) whether tiles touch no cell that is counted; never of
        tiles by the date line.

        margin : how far off the tiles cells are touched, too [rad]
        """
        rows, columns = (length - 1 for length in sums.shape[1:])
        top, bottom, left, right, wider = self._corners
        tall = (margin + self._bulge) / np.pi
        wide = wider * tall
        left, right = np.floor(rows * (left - wide)), np.ceil(rows * (right + wide))
        inside = (left >= 0) & (right <= columns)
        top, bottom = np.floor(rows * (top - tall)), np.ceil(rows * (bottom + tall))
        above, below = ((columns + 1) * row.clip(0, rows).astype(np.intp) for row in (top, bottom))
        first, last = (column.clip(0, columns).astype(np.intp) for column in (left, right))
        flat = sums.reshape(len(sums), -1)

        def counted(row: IndexArray, column: IndexArray) -> AnyArray:
            return flat.take(row + column, axis=1)

        within = counted(below, last) - counted(above, last)
        none = within == counted(below, first) - counted(above, first)
        return np.asarray(none & inside)
