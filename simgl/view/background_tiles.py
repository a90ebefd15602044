"""What of the Earth lies where in an image, by tiles: each is drawn as simply as it can be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from simgl.arrays import AnyArray, Array, Array32, IndexArray, Mask
from simgl.physics.air_profile import AIR_TOP
from simgl.physics.frames import norm
from simgl.scene.frost import frost_limits
from simgl.view.background import PlanetView
from simgl.view.map_cells import MapBounds, MapCells

# Edge of a tile [pixels], and into how many along each edge it may be cut.
TILE, PARTS = 16, 2
# Tiles along each edge of a larger one, where they change so evenly.
MERGED = 2
# A pixel may show what is seen so far around it [pixels]: widest ramp to its neighbours.
_SEEN_AROUND = 2
# What may change along a tile's edge. Between its corners a place lies off by an eighth of the
# slant's change, in edges: 1/8 pixel; light that falls by e while the Sun's cosine changes by c is
# off by 1 / 8 of the squared change over c, 0.1 %.
_SLANT_CHANGE = 0.0625
_LONGITUDE_CHANGE = 0.05
_SUN_CHANGE = 0.09
# Cosine that light takes to fall by e at the terminator.
_TWILIGHT = 0.026
# Where the Sun stands lower than both, sines, a sky whose lit part is narrow has so little of its
# light that coarse texels change irradiance and lobes by less than 1e-3: where the air is dark, and
# so far below the highest.
_DARK, _FADED = -0.1, 0.15
# Where the noise of two faces of its cube is mixed, as in shaders/planet/chart.glsl; and how far
# off the place that is seen the clouds before it and before the Sun may lie, in their heights.
_CHART_SEAM, _CLOUD_REACH = 0.02, 10.0
# Tangent squared of the steepest waves whose glint shows gusts (shaders/planet/wind.glsl).
_NO_GUSTS = 0.24
# As in shaders/planet/place.glsl.
_LONG_EDGE, _SHADOW_SINE = 0.9, 0.10


@dataclass(frozen=True, kw_only=True, eq=False)
class BackgroundTiles:
    """What is seen where in some images: masks (images, rows, columns) of tiles, those of the first
    five on different places.

    even : on the ground, which they see change evenly
    finer : on the ground, which their ``PARTS`` see change evenly
    ground : with other ground on them
    air : that miss the ground; what is in none of these masks misses air and clouds, too
    calm : even ones of which ``MERGED`` along each edge may be one tile
    low, high : sines of the Sun's height, the least and the most
    glint : on which the sea may mirror the Sun so that gusts and slicks show
    clear : without any cloud before them or before the Sun, where their pixels are no larger than
        texels of the clouds' map
    known : what they show in any light
    """

    even: Mask
    finer: Mask
    ground: Mask
    air: Mask
    calm: Mask
    low: Array
    high: Array
    glint: Mask
    clear: Mask
    known: GroundTiles

    @property
    def any(self) -> Mask:
        """Tiles with ground or air on them."""
        return self.even | self.finer | self.ground | self.air

    @property
    def brightest(self) -> Mask:
        """Tiles that hold nearly all of the Sun's light, where little of the Earth is lit."""
        highest = float(self.high[self.any].max(initial=-1.0))
        return self.any & (self.high > min(_DARK, highest - _FADED))

    def within(self, mask: Mask) -> BackgroundTiles:
        """Those of a mask."""
        return replace(
            self,
            even=self.even & mask,
            finer=self.finer & mask,
            ground=self.ground & mask,
            air=self.air & mask,
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class GroundTiles:
    """What the tiles of some images show of the Earth in any light, (images, rows, columns) each.

    All but the first three tell of tiles with nothing but ground on them.

    ground, air : whether there is any
    frosted : whether there may be sea ice or snow
    bend : root of how fast slant or longitude change, of what is even; no number for other tiles
    one_face : whether they lie on one face of the noise's cube
    two_faces : (3, images, rows, columns) on the faces about all axes but the first, the second, or
        the third
    sea, land : without a shore
    high_clouds : whether there may be thin high cloud before it
    pixel : edge of a pixel on the ground [m]
    noise_pixel : the same, or most of its long edge: noise is no finer [m]
    normal : (3, images, rows + 1, columns + 1) of the ground at their corners, ITRF
    view : towards the camera there, ITRF; None where gusts and slicks show nowhere
    bounds : where they lie on maps
    cells : of the maps; None where nothing is known of them
    clouds_off : how far off the ground that is seen clouds before it stand [Earth radii]
    clouds_height : of their layer [Earth radii]
    """

    ground: Mask
    air: Mask
    frosted: Mask
    bend: Array
    one_face: Mask
    two_faces: Mask
    sea: Mask
    land: Mask
    high_clouds: Mask
    pixel: Array
    noise_pixel: Array
    normal: Array
    view: Array | None
    bounds: MapBounds
    cells: MapCells | None
    clouds_off: Array
    clouds_height: float

    def in_light_of(self, sun_direction_itrf: Array32) -> BackgroundTiles:
        """The tiles in the light of the Sun, or of the Moon in its place."""
        sun = sun_direction_itrf.astype(np.float64)
        sine = _along(sun, self.normal)
        low, high = _extremes(sine)
        bend = unevenness(self.bend, low, high)
        even = bend < 1.0
        finer = (bend < PARTS) & ~even
        seen = even | finer
        return BackgroundTiles(
            even=even,
            finer=finer,
            ground=self.ground & ~seen,
            air=self.air & ~self.ground,
            # A quarter of the even tiles' error: 1/32 pixel.
            calm=bend < 1.0 / (2.0 * MERGED),
            low=low,
            high=high,
            glint=self._glinting(sun, sine, high),
            clear=self._clear(low),
            known=self,
        )

    def _clear(self, lowest: Array) -> Mask:
        """Whether no cloud stands before tiles or before the Sun there.

        lowest : sine of the Sun's height
        """
        if self.cells is None:
            return np.zeros_like(self.ground)
        steepest = np.sqrt(np.maximum(1.0 - lowest**2, 0.0)) / np.maximum(lowest, _SHADOW_SINE)
        off = np.maximum(self.clouds_off, self.clouds_height * steepest)
        return self.bounds.free_of_clouds(self.cells, 1, off)

    def _glinting(self, sun: Array, sine: Array, highest: Array) -> Mask:
        """Whether the sea of a tile, if it has any, shows gusts and slicks by the Sun's glint."""
        if self.view is None:
            return np.zeros_like(self.ground)
        # Of the normal from half-way between camera and Sun.
        across = np.sqrt(np.maximum(2.0 + 2.0 * _along(sun, self.view), 1e-12))
        cosine = np.maximum((_dot(self.view, self.normal) + sine) / across, 0.05)
        low, high = _extremes(1.0 / cosine**2 - 1.0)
        return (low - (high - low) < _NO_GUSTS) & (highest > 0.0)


def ground_tiles(
    planet: PlanetView,
    turns: Sequence[Array32],
    intrinsics: Array32,
    size: tuple[int, int],
    cells: MapCells | None = None,
    *,
    noise: bool = True,
) -> GroundTiles:
    """The tiles of some images: found together, those of small images take little longer than those
    of one.

    planet : from the place of the pinholes
    turns : ``PlanetView.sphere_from_camera`` of each
    intrinsics : (3, 3) of every image [pixels]
    size : width and height [pixels]; the last tiles may reach past it
    cells : of the maps; None where nothing is known of them
    noise : whether the images show any
    """
    corners = _corners_on_ground(planet, turns, intrinsics, size)
    x, y, z = corners.normal
    latitude, longitude = np.arctan2(z, np.sqrt(x * x + y * y)), np.arctan2(y, x)
    low, high = _extremes(np.stack([corners.slant, latitude, longitude, z]))
    slanted = (high[0] - low[0]) / (_SLANT_CHANGE * np.maximum(low[0], 1e-9))
    bend = np.sqrt(np.maximum(slanted, (high[2] - low[2]) / _LONGITUDE_CHANGE))
    bend[~_over_corners(np.logical_and, corners.meets)] = np.inf
    ground, air = _ground_and_air(planet, turns, intrinsics, size)
    one_face, two_faces = np.ones_like(ground), np.zeros((3, *ground.shape), dtype=bool)
    if noise:
        away = _extremes(_from_faces(corners.normal, _CHART_SEAM + _CLOUD_REACH * _clouds(planet)))
        two_faces = away[0] > 0.0
        one_face = two_faces.sum(axis=0) == 2
        two_faces = two_faces & ~one_face
    shortening = np.sqrt(np.maximum(corners.slant, 1e-3))
    spacing = corners.distance / shortening
    noise_spacing = spacing * np.maximum(_LONG_EDGE / shortening, 1.0)
    per_pixel = 0.25 * planet.earth.equatorial_radius / float(intrinsics[0, 0])
    pixels = per_pixel * _over_corners(np.add, np.stack([spacing, noise_spacing]))
    bounds = MapBounds(low=low[1:], high=high[1:], pixel=pixels[0] / planet.earth.equatorial_radius)
    # The clouds that are seen before a place stand beside it.
    slant = np.clip(low[0], 0.05, 1.0)
    clouds_off = _clouds(planet) * np.sqrt(1.0 - slant**2) / slant
    sea, land, cloudless = np.zeros((3, *ground.shape), dtype=bool)
    if cells is not None:
        sea, land = bounds.on_one_side(cells)
        cloudless = bounds.free_of_clouds(cells, 0, clouds_off)
    return GroundTiles(
        ground=ground,
        air=air,
        frosted=_frosted(planet, low[3], high[3]),
        bend=bend,
        one_face=one_face,
        two_faces=two_faces,
        sea=sea,
        land=land,
        high_clouds=~cloudless,
        pixel=pixels[0],
        noise_pixel=pixels[1],
        normal=corners.normal,
        view=corners.view if planet.earth.wind_varies and noise else None,
        bounds=bounds,
        cells=cells,
        clouds_off=clouds_off,
        clouds_height=_clouds(planet),
    )


def unevenness(bend: Array, low: Array, high: Array) -> Array:
    """How unevenly tiles see the ground change: below 1 where evenly enough, and by a factor less
    across each of so many parts along an edge.

    bend : of what does not depend on the light
    low, high : sines of the Sun's height
    """
    height = np.maximum(np.minimum(np.abs(low), np.abs(high)), _TWILIGHT)
    return np.maximum(bend, (high - low) / (_SUN_CHANGE * height))


def tiles_behind(bare: Mask, corner: tuple[int, int], edge: float, size: tuple[int, int]) -> Mask:
    """(rows, columns) tiles of an image in which spacecraft hide all that is behind them.

    Of tiles that may be drawn as one (``MERGED``) all or none, so that those beside hidden ones are
    drawn as always.

    bare : (rows, columns) of blocks, whether something is seen past the spacecraft there
    corner : x, y of the first block [pixels]; beyond the blocks nothing hides anything
    edge : of a block [pixels]
    size : width and height of the image [pixels]; the last tiles may reach past it
    """
    step = TILE * MERGED

    def blocks(first: int, count: int, length: int) -> tuple[IndexArray, IndexArray, Mask]:
        """First and end of the blocks of each large tile along an axis; whether they hold it."""
        low = step * np.arange(-(-length // step))
        high = np.minimum(low + step, length) + _SEEN_AROUND
        low = np.maximum(low - _SEEN_AROUND, 0)
        high = np.minimum(high, length)
        start = np.floor((low - first) / edge).astype(np.int64)
        end = np.ceil((high - first) / edge).astype(np.int64)
        inside = (start >= 0) & (end <= count)
        return start.clip(0, count), end.clip(0, count), inside

    left, right, in_columns = blocks(corner[0], bare.shape[1], size[0])
    top, bottom, in_rows = blocks(corner[1], bare.shape[0], size[1])
    seen = _any_within(_any_within(bare, top, bottom).T, left, right).T
    hidden = split(~seen & in_columns & in_rows[:, None], MERGED)
    columns, rows = (-(-length // TILE) for length in size)
    return hidden[:rows, :columns]


def _any_within(values: Mask, first: IndexArray, end: IndexArray) -> Mask:
    """(ranges, columns) whether any of the rows of some ranges is true; ranges hold a row each."""
    # Every second one reaches from the end of a range to the next; the last may begin at the end.
    padded = np.concatenate([values, np.zeros((1, values.shape[1]), dtype=bool)])
    bounds = np.stack([first, end], axis=1).ravel()
    return np.asarray(np.logical_or.reduceat(padded, bounds, axis=0)[::2])


def _frosted(planet: PlanetView, low: Array, high: Array) -> Mask:
    """Whether a tile may have ice or snow on it, with what its corners span as a margin.

    low, high : sines of latitude
    """
    if not planet.earth.frost:
        return np.zeros(low.shape, dtype=bool)
    south, north = np.sin(frost_limits(planet.year_share))
    margin = high - low + 1e-3
    return (high + margin > north) | (low - margin < south)


def _clouds(planet: PlanetView) -> float:
    """Height of the layer of clouds, in Earth radii."""
    clouds = planet.earth.clouds
    return 0.0 if clouds is None else clouds.height / planet.earth.equatorial_radius


def _ground_and_air(
    planet: PlanetView, turns: Sequence[Array32], intrinsics: Array32, size: tuple[int, int]
) -> tuple[Mask, Mask]:
    """(images, rows, columns) whether tiles, and a pixel about them, may have ground and clouds, or
    anything of the Earth and its air on them."""
    distance, earth = float(np.sqrt(1.0 + planet.outside)), planet.earth
    tops = 0.0 if earth.clouds is None else earth.clouds.top / earth.equatorial_radius
    height = 0.0 if earth.air is None else AIR_TOP / earth.equatorial_radius
    columns, rows = (-(-length // TILE) for length in size)
    middles = _rays(turns, intrinsics, (columns, rows), 0.5)
    nadir = -planet.camera_in_sphere.astype(np.float64)
    cosine = _along(nadir / norm(nadir), middles)
    cosine /= np.sqrt(_dot(middles, middles))
    # No tile is wider than one in the middle of the image.
    half = 0.5 * TILE * float(np.hypot(1.0 / intrinsics[0, 0], 1.0 / intrinsics[1, 1]))

    def before(top: float) -> Mask:
        """Where something may be seen of a sphere of this radius."""
        angle = float(np.arcsin(min(top / distance, 1.0))) + (1.0 + 4.0 / TILE) * half
        return np.asarray(cosine > (np.cos(angle) if angle < np.pi else -2.0))

    ground, top = before(1.0 + tops), 1.0 + max(height, tops)
    return ground, before(top) if distance > top else np.ones_like(ground)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Corners:
    """Of the tiles of images, (images, rows + 1, columns + 1): where they lie on the ground.

    Of corners beside the Earth, the place on their ray that is nearest to it.

    meets : whether the ground is there
    normal : (3, ...) of it, ITRF
    slant : cosine of the ray from the vertical
    view : (3, ...) towards the camera, ITRF
    distance : in Earth radii
    """

    meets: Mask
    normal: Array
    slant: Array
    view: Array
    distance: Array


def _corners_on_ground(
    planet: PlanetView, turns: Sequence[Array32], intrinsics: Array32, size: tuple[int, int]
) -> _Corners:
    """What the corners of tiles see of the ground; arguments as for ``ground_tiles``."""
    columns, rows = (-(-length // TILE) + 1 for length in size)
    d = _rays(turns, intrinsics, (columns, rows), 0.0)
    place = planet.camera_in_sphere.astype(np.float64)
    radii = np.array(planet.earth.radii)[:, None, None, None]
    dd, od = _dot(d, d), _along(place, d)
    discriminant = od * od - dd * planet.outside
    meets = (discriminant > 0.0) & (od < 0.0)
    root = np.sqrt(np.maximum(discriminant, 0.0))
    nearest = np.maximum(-od, 0.0) / dd
    distance = np.where(meets, planet.outside / np.where(meets, root - od, 1.0), nearest)
    return _Corners(
        meets=meets,
        normal=_unit((place[:, None, None, None] + distance * d) / radii),
        slant=root / np.sqrt(dd),
        view=-_unit(d * radii),
        distance=distance,
    )


def _from_faces(normal: Array, margin: float) -> Array:
    """(3, ...) how far places lie from the faces about each axis of a cube about the Earth."""
    size = np.abs(normal)
    return size.max(axis=0) * (1.0 - margin) - size


def _rays(
    turns: Sequence[Array32], intrinsics: Array32, count: tuple[int, int], first: float
) -> Array:
    """(3, images, rows, columns) unit directions in camera axes, turned into sphere space.

    count : columns and rows of places, a tile's edge apart
    first : of the image's first corner, in edges
    """
    rays = _camera_rays(intrinsics.astype(np.float64).tobytes(), count, first)
    turned = np.stack(turns, axis=1)
    directions = turned.astype(np.float64).reshape(-1, 3) @ rays
    return directions.reshape(3, len(turns), count[1], count[0])


@lru_cache(maxsize=16)
def _camera_rays(intrinsics: bytes, count: tuple[int, int], first: float) -> Array:
    """(3, rows * columns) of these rays in camera axes."""
    k = np.frombuffer(intrinsics).reshape(3, 3)
    x = (TILE * (np.arange(count[0]) + first) - k[0, 2]) / k[0, 0]
    y = (TILE * (np.arange(count[1]) + first) - k[1, 2]) / k[1, 1]
    x, y = np.broadcast_arrays(x, y[:, None])
    rays = _unit(np.stack([x.ravel(), y.ravel(), np.ones(x.size)]))
    rays.flags.writeable = False
    return rays


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def _along(direction: Array, vectors: Array) -> Array:
    """Products of a direction (3,) and vectors (3, ...): ``tensordot`` in a tenth of its time."""
    return np.asarray((direction[None] @ vectors.reshape(3, -1)).reshape(vectors.shape[1:]))


def _unit(vectors: Array) -> Array:
    return vectors / np.sqrt(_dot(vectors, vectors))


def _over_corners(of_two: np.ufunc, values: AnyArray) -> AnyArray:
    """What a function of two makes of the four corners of every tile."""
    across = of_two(values[..., :-1], values[..., 1:])
    return of_two(across[..., :-1, :], across[..., 1:, :])


def _extremes(values: Array) -> tuple[Array, Array]:
    """The least and the most at the four corners of every tile."""
    return _over_corners(np.minimum, values), _over_corners(np.maximum, values)


def split(tiles: Mask, parts: int) -> Mask:
    """Smaller tiles: the parts of those in a mask (..., rows, columns)."""
    return tiles.repeat(parts, axis=-2).repeat(parts, axis=-1)
