"""What of the Earth lies where in an image, by tiles: each is drawn as simply as it can be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from simgl.arrays import AnyArray, Array, Array32, IndexArray, Mask
from simgl.physics.air_profile import AIR_TOP
from simgl.scene.frost import frost_limits
from simgl.view.background import PlanetView

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
# Where the noise of two faces of its cube is mixed, as in shaders/planet/chart.glsl; and how far
# off the place that is seen the clouds before it and before the Sun may lie, in their heights.
_CHART_SEAM, _CLOUD_REACH = 0.02, 10.0
# Tangent squared of the steepest waves whose glint shows gusts (shaders/planet/wind.glsl).
_NO_GUSTS = 0.24
# As in shaders/planet/place.glsl.
_LONG_EDGE = 0.9


@dataclass(frozen=True, kw_only=True, eq=False)
class BackgroundTiles:
    """What is seen where in an image: masks (rows, columns) of tiles, no two on one place.

    even : on the ground, which they see change evenly
    finer : on the ground, which their ``PARTS`` see change evenly
    calm : even ones of which ``MERGED`` along each edge may be one tile
    ground : with other ground on them
    air : that miss the ground; what is in none of these masks misses air and clouds, too
    one_face : those of the even and the finer ones on one face of the noise's cube
    two_faces : (3, rows, columns) likewise those on the faces about all axes but the first, the
        second, or the third
    sea, land : likewise those that have no shore on them
    high_clouds : those of the even and the finer ones that may have thin high cloud before them
    frosted : those of all that may have sea ice or snow on them
    glint : those of all on which the sea may mirror the Sun so that gusts and slicks show
    low, high : (rows, columns) sines of the Sun's height there, the least and the most
    pixel : (rows, columns) edge of a pixel on the ground of the even and the finer ones [m]
    noise_pixel : (rows, columns) the same, or most of its long edge: noise is no finer [m]
    """

    even: Mask
    finer: Mask
    calm: Mask
    ground: Mask
    air: Mask
    one_face: Mask
    two_faces: Mask
    sea: Mask
    land: Mask
    high_clouds: Mask
    frosted: Mask
    glint: Mask
    low: Array
    high: Array
    pixel: Array
    noise_pixel: Array

    @property
    def any(self) -> Mask:
        """Tiles with ground or air on them."""
        return self.even | self.finer | self.ground | self.air

    def within(self, mask: Mask) -> BackgroundTiles:
        """Those of a mask."""
        return replace(
            self,
            even=self.even & mask,
            finer=self.finer & mask,
            calm=self.calm & mask,
            ground=self.ground & mask,
            air=self.air & mask,
            one_face=self.one_face & mask,
            two_faces=self.two_faces & mask,
            sea=self.sea & mask,
            land=self.land & mask,
            high_clouds=self.high_clouds & mask,
            frosted=self.frosted & mask,
            glint=self.glint & mask,
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class MapCells:
    """What the cells of equirectangular maps hold.

    Each is (rows + 1, columns + 1) of their corners: how many of those above and left of it are

    shores : not all open sea
    waters : not all inland
    high_clouds : not free of thin high cloud
    """

    shores: IndexArray
    waters: IndexArray
    high_clouds: IndexArray


def tiles_of(
    planets: Sequence[PlanetView],
    intrinsics: Array32,
    size: tuple[int, int],
    cells: MapCells | None = None,
    *,
    noise: bool = True,
) -> list[BackgroundTiles]:
    """The tiles of each of some images: found together, those of small images take little longer
    than those of one.

    planets : one Earth from one place in one light, before pinholes that look elsewhere
    intrinsics : (3, 3) of every image [pixels]
    size : width and height [pixels]; the last tiles may reach past it
    cells : of the maps; None where nothing is known of them
    noise : whether the images show any
    """
    planet = planets[0]
    corners = corners_on_ground(planets, intrinsics, size)
    even, finer = even_tiles(corners), even_tiles(corners, PARTS)
    finer &= ~even
    # A quarter of the even tiles' error: 1/32 pixel.
    calm = even & even_tiles(corners, 1.0 / (2.0 * MERGED))
    one_face, two_faces = np.ones_like(even), np.zeros((3, *even.shape), dtype=bool)
    if noise:
        margin = _CHART_SEAM + _CLOUD_REACH * _cloud_height(planet)
        one_face = _on_one_face(corners.normal, margin)
        if not one_face.all():
            two_faces = _on_two_faces(corners.normal, margin) & ~one_face
    nearest = _nadir_angles(planets, intrinsics, size)
    distance = float(np.sqrt(1.0 + planet.outside))
    height = 0.0 if planet.earth.air is None else AIR_TOP / planet.earth.equatorial_radius
    cloud_tops = _cloud_tops(planet)
    top = 1.0 + max(height, cloud_tops)
    ground = nearest < np.arcsin(min((1.0 + cloud_tops) / distance, 1.0))
    air = (nearest < np.arcsin(top / distance)) if distance > top else np.ones_like(ground)
    shortened = np.maximum(corners.slant, 1e-3)
    spacing = corners.distance / np.sqrt(shortened)
    noise_spacing = spacing * np.maximum(_LONG_EDGE / np.sqrt(shortened), 1.0)
    per_pixel = 0.25 * planet.earth.equatorial_radius / float(intrinsics[0, 0])
    seen = even | finer
    sea = land = np.zeros_like(even)
    high_clouds = seen
    if cells is not None and seen.any():
        # The clouds that are seen before a place stand beside it.
        slant = np.clip(_lowest(corners.slant), 0.05, 1.0)
        parallax = _cloud_height(planet) * np.sqrt(1.0 - slant**2) / slant
        touched = _Touched.by(corners, cells.shores.shape, parallax)
        sea = seen & touched.none(cells.shores)
        land = seen & touched.none(cells.waters)
        high_clouds = seen & ~touched.none(cells.high_clouds)
    arrays = {
        "even": even,
        "finer": finer,
        "calm": calm,
        "ground": ground & ~seen,
        "air": air & ~ground,
        "one_face": one_face & seen,
        "two_faces": np.moveaxis(two_faces & seen, 1, 0),
        "sea": sea,
        "land": land,
        "high_clouds": high_clouds,
        "frosted": _frosted(planets[0], corners),
        "glint": _glinting(planets[0], corners, noise=noise),
        "low": _lowest(corners.sun),
        "high": _highest(corners.sun),
        "pixel": per_pixel * _over_corners(np.add, spacing),
        "noise_pixel": per_pixel * _over_corners(np.add, noise_spacing),
    }
    return [
        BackgroundTiles(**{name: array[face] for name, array in arrays.items()})
        for face in range(len(planets))
    ]


def tiles_behind(bare: Mask, corner: tuple[int, int], edge: float, size: tuple[int, int]) -> Mask:
    """(rows, columns) tiles of an image in which spacecraft hide all that is behind them.

    Of tiles that may be drawn as one (``MERGED``) all or none, so that those beside hidden ones are
    drawn as always.

    bare : (rows, columns) of blocks, whether something is seen past the spacecraft there
    corner : x, y of the first block [pixels]; beyond the blocks nothing hides anything
    edge : of a block [pixels]
    size : width and height of the image [pixels]; the last tiles may reach past it
    """
    sums = np.zeros(tuple(n + 1 for n in bare.shape), dtype=np.int64)
    sums[1:, 1:] = bare.cumsum(axis=0).cumsum(axis=1)
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
    across = sums[:, right] - sums[:, left]
    none = across[bottom] == across[top]
    hidden = split(none & in_columns & in_rows[:, None], MERGED)
    columns, rows = (-(-length // TILE) for length in size)
    return hidden[:rows, :columns]


def _frosted(planet: PlanetView, corners: Corners) -> Mask:
    """Whether a tile may have ice or snow on it, with what its corners span as a margin."""
    sine = corners.normal[..., 2]
    if not planet.earth.frost:
        return np.zeros_like(_highest(sine), dtype=bool)
    south, north = np.sin(frost_limits(planet.year_share))
    margin = _range(sine) + 1e-3
    return (_highest(sine) + margin > north) | (_lowest(sine) - margin < south)


def _glinting(planet: PlanetView, corners: Corners, *, noise: bool) -> Mask:
    """Whether the sea of a tile, if it has any, shows gusts and slicks by the Sun's glint."""
    if not (planet.earth.wind_varies and noise):
        return np.zeros_like(_highest(corners.sun), dtype=bool)
    half_way = _unit(corners.view + planet.sun_direction_itrf.astype(np.float64))
    cosine = np.maximum(np.einsum("...i,...i", half_way, corners.normal), 0.05)
    steepness = 1.0 / cosine**2 - 1.0
    return (_lowest(steepness) - _range(steepness) < _NO_GUSTS) & (_highest(corners.sun) > 0.0)


def _cloud_height(planet: PlanetView) -> float:
    """In Earth radii."""
    clouds = planet.earth.clouds
    return 0.0 if clouds is None else clouds.height / planet.earth.equatorial_radius


def _cloud_tops(planet: PlanetView) -> float:
    """Height of the highest towers, in Earth radii."""
    clouds = planet.earth.clouds
    return 0.0 if clouds is None else clouds.top / planet.earth.equatorial_radius


def _nadir_angles(
    planets: Sequence[PlanetView], intrinsics: Array32, size: tuple[int, int]
) -> Array:
    """(images, rows, columns) least angle from nadir in each tile and a pixel about it [rad]."""
    columns, rows = (-(-length // TILE) for length in size)
    middles = _unit(_rays(planets, intrinsics, (columns, rows), 0.5))
    nadir = _unit(-planets[0].camera_in_sphere.astype(np.float64))
    angle = np.arccos(np.clip(middles @ nadir, -1.0, 1.0))
    # No tile is wider than one in the middle of the image.
    half = 0.5 * TILE * float(np.hypot(1.0 / intrinsics[0, 0], 1.0 / intrinsics[1, 1]))
    return angle - (1.0 + 4.0 / TILE) * half


@dataclass(frozen=True, kw_only=True, eq=False)
class Corners:
    """Of the tiles of images, (images, rows + 1, columns + 1): where they lie on the ground.

    Of corners beside the Earth, the place on their ray that is nearest to it.

    meets : whether the ground is there
    normal : of it, ITRF
    sun : sine of the Sun's height
    slant : cosine of the ray from the vertical
    view : towards the camera, ITRF
    distance : in Earth radii
    """

    meets: Mask
    normal: Array
    sun: Array
    slant: Array
    view: Array
    distance: Array


def corners_on_ground(
    planets: Sequence[PlanetView], intrinsics: Array32, size: tuple[int, int]
) -> Corners:
    """What the corners of tiles see of the ground.

    planets : one Earth from one place, before pinholes that look elsewhere
    intrinsics : (3, 3) [pixels]
    size : of the image, width and height [pixels]; the last tiles may reach past it
    """
    columns, rows = (-(-length // TILE) + 1 for length in size)
    planet = planets[0]
    d = _rays(planets, intrinsics, (columns, rows), 0.0)
    place = planet.camera_in_sphere.astype(np.float64)
    dd, od = np.einsum("...i,...i", d, d), d @ place
    discriminant = od * od - dd * planet.outside
    meets = (discriminant > 0.0) & (od < 0.0)
    root = np.sqrt(np.maximum(discriminant, 0.0))
    nearest = np.maximum(-od, 0.0) / dd
    distance = np.where(meets, planet.outside / np.where(meets, root - od, 1.0), nearest)
    normal = _unit((place + distance[..., None] * d) / np.array(planet.earth.radii))
    return Corners(
        meets=meets,
        normal=normal,
        sun=normal @ planet.sun_direction_itrf.astype(np.float64),
        slant=root / np.sqrt(dd),
        view=-_unit(d * np.array(planet.earth.radii)),
        distance=distance,
    )


def even_tiles(corners: Corners, parts: float = 1.0) -> Mask:
    """(images, rows, columns) whether a tile lies on the ground and its parts see it change evenly.

    What bends across a tile bends by the square of ``parts`` less across one of them.
    """
    normal, slant, sun = corners.normal, corners.slant, corners.sun
    longitude = np.arctan2(normal[..., 1], normal[..., 0])
    even = _lowest(corners.meets) & (_range(slant) < parts**2 * _SLANT_CHANGE * _lowest(slant))
    even &= _range(longitude) < parts**2 * _LONGITUDE_CHANGE
    sun_height = np.maximum(_lowest(np.abs(sun)), _TWILIGHT)
    return even & (_range(sun) < parts * _SUN_CHANGE * sun_height)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Touched:
    """The cells of a map that tiles may touch, (images, rows, columns) each: first, past the last.

    inside : whether these are all; not of tiles by the date line
    """

    top: IndexArray
    bottom: IndexArray
    left: IndexArray
    right: IndexArray
    inside: Mask

    @staticmethod
    def by(corners: Corners, shape: tuple[int, ...], margin: Array) -> _Touched:
        """Of the tiles with these corners.

        shape : of the sums in ``MapCells``
        margin : how far off the tiles cells are touched, too [rad]
        """
        rows, columns = shape[0] - 1, shape[1] - 1
        x, y, z = np.moveaxis(corners.normal, -1, 0)
        across = np.hypot(x, y)
        row = (0.5 - np.arctan2(z, across) / np.pi) * rows
        column = (np.arctan2(y, x) / (2.0 * np.pi) + 0.5) * columns
        high = 0.5 + rows / np.pi * margin
        wide = 0.5 + 0.5 * columns / np.pi * margin / np.maximum(_lowest(across), 1e-3)
        top, bottom = np.floor(_lowest(row) - high), np.ceil(_highest(row) + high)
        left, right = (
            np.floor(_lowest(column) - wide),
            np.ceil(_highest(column) + wide),
        )
        return _Touched(
            top=np.clip(top, 0, rows).astype(np.int64),
            bottom=np.clip(bottom, 0, rows).astype(np.int64),
            left=np.clip(left, 0, columns).astype(np.int64),
            right=np.clip(right, 0, columns).astype(np.int64),
            inside=(left >= 0) & (right <= columns),
        )

    def none(self, sums: IndexArray) -> Mask:
        """Whether none of the cells touched is counted by a map's sums."""
        within = sums[self.bottom, self.right] - sums[self.top, self.right]
        return self.inside & (within == sums[self.bottom, self.left] - sums[self.top, self.left])


def _on_one_face(normal: Array, margin: float) -> Mask:
    """Whether a tile lies on one face of a cube about the Earth, so far from its edges."""
    size = np.abs(normal)
    two, one = np.moveaxis(np.partition(size, 1, axis=-1)[..., 1:], -1, 0)
    faces = np.argmax(size, axis=-1) + 3 * (np.max(normal, axis=-1) == one)
    return (_range(faces) == 0) & (_lowest(one * (1.0 - margin) - two) > 0.0)


def _on_two_faces(normal: Array, margin: float) -> Mask:
    """(3, images, rows, columns) whether a tile lies so far from the faces about each axis."""
    size = np.moveaxis(np.abs(normal), -1, 0)
    far = size.max(axis=0) * (1.0 - margin) - size
    return np.stack([_lowest(of_axis) > 0.0 for of_axis in far])


def _rays(
    planets: Sequence[PlanetView], intrinsics: Array32, count: tuple[int, int], first: float
) -> Array:
    """(images, rows, columns, 3) unit directions in camera axes, turned into sphere space.

    count : columns and rows of places, a tile's edge apart
    first : of the image's first corner, in edges
    """
    k = intrinsics.astype(np.float64)
    x = (TILE * (np.arange(count[0]) + first) - k[0, 2]) / k[0, 0]
    y = (TILE * (np.arange(count[1]) + first) - k[1, 2]) / k[1, 1]
    x, y = np.broadcast_arrays(x, y[:, None])
    rays = _unit(np.stack([x, y, np.ones_like(x)], axis=-1))
    turned = np.stack([planet.sphere_from_camera for planet in planets]).astype(np.float64)
    return rays @ turned.transpose(0, 2, 1)[:, None]


def _unit(vectors: Array) -> Array:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def _over_corners(of_two: np.ufunc, values: AnyArray) -> AnyArray:
    """What a function of two makes of the four corners of every tile."""
    across = of_two(values[..., :-1], values[..., 1:])
    return of_two(across[..., :-1, :], across[..., 1:, :])


def _lowest(values: AnyArray) -> AnyArray:
    return _over_corners(np.minimum, values)


def _highest(values: AnyArray) -> AnyArray:
    return _over_corners(np.maximum, values)


def _range(values: Array) -> Array:
    return _highest(values) - _lowest(values)


def merged(tiles: Mask) -> Mask:
    """Larger tiles: those all of whose parts are in a mask."""
    rows, columns = (length // MERGED for length in tiles.shape)
    full = tiles[: rows * MERGED, : columns * MERGED]
    return np.asarray(full.reshape(rows, MERGED, columns, MERGED).all(axis=(1, 3)))


def split(tiles: Mask, parts: int) -> Mask:
    """Smaller tiles: the parts of those in a mask."""
    return tiles.repeat(parts, axis=0).repeat(parts, axis=1)
