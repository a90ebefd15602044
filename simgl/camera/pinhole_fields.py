"""The field of view of a distorting lens as pinhole cameras see it: one, or the faces of a cube."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace

import numpy as np

from simgl.arrays import Array, Array32, Mask
from simgl.camera.camera import Camera
from simgl.camera.chebyshev import chebyshev_interpolation, chebyshev_nodes
from simgl.camera.projections import Distortion
from simgl.errors import ConfigError
from simgl.lru_cache import MANY, LruCache

# Pixels around a field, for interpolation at its edges.
_MARGIN = 3
# A pinhole's image of more than this many times the lens's costs more than the faces of a cube.
_LARGEST_IMAGE = 2.0
# Fields larger than this many times the image come from coefficients that do not fit the lens.
_LARGEST_FIELD = 3.0
# A pinhole sees no farther than 90 deg off its boresight, and needs too many pixels before that.
_WIDEST_DEG = 85.0
# Pixels of an image with distortion: 2 GB for the lines of sight while they are computed.
_MAX_PIXELS = 1 << 25
# The background and the truth are drawn on pixels smaller than the detector's by this factor.
FINER = 2
# Of the arrays of cameras in the cache, by their geometry: exposures may change with each image.
_MAX_BYTES = 256 << 20
# Nodes along an edge of the polynomials for the lines of sight, and the error with half of them at
# which as many are enough: that with all of them is about its square.
_NODES = (17, 33, 65, 129, 257)
_HALVED_ERROR = 1e-9
# Rows of pixels whose lines of sight are computed together where no polynomial fits.
_ROWS = 64
# Cosine of the widest angle that a pixel next to one that is drawn may have.
_NARROWEST = 0.05
# The faces of a cube: the axes of each, as rows, in camera axes. The first looks ahead.
_FACES = np.array(
    [
        [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        [[0, 0, -1], [0, 1, 0], [1, 0, 0]],
        [[0, 0, 1], [0, 1, 0], [-1, 0, 0]],
        [[1, 0, 0], [0, 0, -1], [0, 1, 0]],
        [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
        [[-1, 0, 0], [0, 1, 0], [0, 0, -1]],
    ],
    dtype=np.float64,
)


@dataclass(frozen=True, kw_only=True, eq=False)
class PinholeField:
    """A part of a distorting lens's field of view, as seen by a pinhole camera.

    key : of the lens's geometry and the part, for caches
    R_pinhole_from_camera : (3, 3) where the pinhole looks
    pinhole : camera without distortion that covers the part; its pixels are square, and as large
        as the camera's on the boresight
    fine : the same with smaller pixels
    centred : ``fine`` with one pixel more each way, so that one lies at the centre of each pixel
    places : (height, width, 2) centres of the camera's pixels in the pinhole's image [px]
    drawn : (height, width) whether a pixel is drawn through this pinhole
    solid_angle : (height, width) of the camera's pixels, relative to that of one on the boresight;
        0 where the lens sees nothing
    reach : to which a pixel sees around its middle, at most [px of the pinhole]
    smallest_step : from a pixel's place to its neighbour's [px of the pinhole]
    """

    key: tuple[Hashable, ...]
    R_pinhole_from_camera: Array
    pinhole: Camera
    fine: Camera
    centred: Camera
    places: Array32
    drawn: Mask
    solid_angle: Array
    reach: int
    smallest_step: float


@dataclass(frozen=True, kw_only=True, eq=False)
class _Part:
    """What a ``PinholeField`` has of its pixels, and the size and boresight of its image [px]."""

    R: Array
    width: int
    height: int
    boresight: tuple[float, float]
    places: Array32
    drawn: Mask
    reach: int
    smallest_step: float


@dataclass(frozen=True, kw_only=True, eq=False)
class _Parts:
    parts: tuple[_Part, ...]
    solid_angle: Array

    @property
    def nbytes(self) -> int:
        each = sum(part.places.nbytes + part.drawn.nbytes for part in self.parts)
        return each + self.solid_angle.nbytes


_cached_parts = LruCache[tuple[Hashable, ...], _Parts](MANY, max_bytes=_MAX_BYTES)


def pinhole_fields(camera: Camera) -> tuple[PinholeField, ...]:
    """The parts of the field of a camera that does not image as a pinhole.

    One where a pinhole sees it all; otherwise the faces of a cube that the lens sees. Each pixel
    that sees anything is drawn through one of them.

    Raises ConfigError if the distortion is not invertible, or a pinhole's field far too large.
    """
    divided = _cached_parts.get(camera.geometry, lambda: _divided(camera), lambda a: a.nbytes)
    return tuple(
        _field(camera, index, part, divided.solid_angle) for index, part in enumerate(divided.parts)
    )


def _field(camera: Camera, index: int, part: _Part, solid_angle: Array) -> PinholeField:
    pitch, (x, y) = camera.detector.pixel_pitch, part.boresight
    lens = replace(
        camera.lens,
        focal_length=camera.lens.focal_length * _scale(camera),
        distortion=None,
        aspect=1.0,
        skew=0.0,
        principal_offset=(pitch * (x - 0.5 * part.width), pitch * (y - 0.5 * part.height)),
    )
    detector = replace(camera.detector, width=part.width, height=part.height)
    pinhole = replace(camera, lens=lens, detector=detector)
    return PinholeField(
        key=(*camera.geometry, index),
        R_pinhole_from_camera=part.R,
        pinhole=pinhole,
        fine=_finer(pinhole, 0),
        centred=_finer(pinhole, 1),
        places=part.places,
        drawn=part.drawn,
        solid_angle=solid_angle,
        reach=part.reach,
        smallest_step=part.smallest_step,
    )


def _finer(pinhole: Camera, more: int) -> Camera:
    d = pinhole.detector
    fine = replace(
        d,
        width=FINER * d.width + more,
        height=FINER * d.height + more,
        pixel_pitch=d.pixel_pitch / FINER,
    )
    return replace(pinhole, detector=fine)


def _scale(camera: Camera) -> float:
    distortion = camera.lens.distortion
    return 1.0 if distortion is None else distortion.scale


def _divided(camera: Camera) -> _Parts:
    d, lens = camera.detector, camera.lens.distortion
    if d.width * d.height > _MAX_PIXELS:
        problem = f"is allowed for at most {_MAX_PIXELS} pixels, got {d.width} x {d.height}"
        raise _refused(camera, problem)
    rays, solid_angle = _on_pixels(camera)
    seen = solid_angle > 0.0  # not where it is no number
    ahead = bool(np.all(rays[seen, 2] > np.cos(np.radians(_WIDEST_DEG))))
    f = camera.focal_length_px * _scale(camera)
    times = 0.0
    if ahead:
        reach = [np.abs(rays[seen, k] / rays[seen, 2]).max(initial=0.0) * f for k in (0, 1)]
        times = max(2.0 * reach[0] / d.width, 2.0 * reach[1] / d.height)
    if lens is None or isinstance(lens, Distortion):
        if not ahead or not seen.all():
            raise _refused(camera, _unseen(camera))
        if not times <= _LARGEST_FIELD:
            problem = f"sees {times:.1f} times the field of a pinhole, at most {_LARGEST_FIELD:g}"
            raise _refused(camera, problem)
        faces = np.zeros(seen.shape, dtype=np.int8)
    else:
        if not seen.any():
            raise _refused(camera, "images nothing on any pixel")
        seen = _inside(seen)
        faces = np.zeros(seen.shape, dtype=np.int8)
        if not ahead or times > _LARGEST_IMAGE:
            faces = np.stack([rays @ face[2] for face in _FACES]).argmax(axis=0).astype(np.int8)
    solid_angle[~seen] = 0.0
    parts = [_part(camera, face, rays, seen & (faces == face)) for face in np.unique(faces[seen])]
    return _Parts(parts=tuple(parts), solid_angle=solid_angle)


def _inside(seen: Mask) -> Mask:
    """Without the pixels at the rim of what a lens images, which see partly nothing."""
    result = seen.copy()
    for axis in (0, 1):
        for step in (-1, 1):
            neighbour = np.roll(seen, step, axis=axis)
            np.moveaxis(neighbour, axis, 0)[0 if step > 0 else -1] = True
            result &= neighbour
    return result


def _part(camera: Camera, face: int, rays: Array, drawn: Mask) -> _Part:
    """The pixels that are drawn through a face of the cube."""
    R = _FACES[face]
    f = camera.focal_length_px * _scale(camera)
    with np.errstate(all="ignore"):
        depth = rays @ R[2]
        depth = np.where(depth > _NARROWEST, depth, np.nan)
        seen = np.stack([rays @ R[0] / depth * f, rays @ R[1] / depth * f], axis=-1)
    margin = _reach(seen, drawn) + _MARGIN
    low, high = (np.array([end(seen[..., k][drawn]) for k in (0, 1)]) for end in (np.min, np.max))
    low, high = np.floor(low) - margin, np.ceil(high) + margin
    width, height = (high - low).astype(int).tolist()
    return _Part(
        R=R,
        width=width,
        height=height,
        boresight=(float(-low[0]), float(-low[1])),
        places=np.nan_to_num(seen - low, nan=-1.0).astype(np.float32),
        drawn=drawn,
        reach=margin - _MARGIN,
        smallest_step=min(
            float(np.nanmin(np.linalg.norm(step, axis=-1)[both], initial=np.inf))
            for step, both in (
                (np.diff(seen, axis=1), drawn[:, 1:] & drawn[:, :-1]),
                (np.diff(seen, axis=0), drawn[1:] & drawn[:-1]),
            )
        ),
    )


def _reach(places: Array, drawn: Mask) -> int:
    """Largest extent of a pixel in the pinhole's image: twice what it sees on either side.

    Every 16th row and column tells it well enough.
    """
    across = np.abs(np.diff(places[::16], axis=1))[drawn[::16, 1:]]
    down = np.abs(np.diff(places[:, ::16], axis=0))[drawn[1:, ::16]]
    sizes = [np.nanmax(steps, axis=0, initial=1.0) for steps in (across, down)]
    return int(np.ceil((sizes[0] + sizes[1]).max()))


def _refused(camera: Camera, problem: str) -> ConfigError:
    return ConfigError(f"[camera.{camera.name}]", "optics.distortion", problem)


def _unseen(camera: Camera) -> str:
    """What keeps a pinhole from drawing the field of a camera."""
    d = camera.detector
    across, down = (np.linspace(0.5, n - 0.5, 99) for n in (d.width, d.height))
    x, y, z = np.moveaxis(camera.rays(np.stack(np.meshgrid(across, down), axis=-1)), -1, 0)
    angle = float(np.nanmax(np.degrees(np.arctan2(np.hypot(x, y), z)), initial=0.0))
    if angle >= _WIDEST_DEG:
        return (
            f"sees {angle:.0f} deg off the boresight, a pinhole below {_WIDEST_DEG:g} deg; "
            "wider lenses are fisheye or double_sphere"
        )
    return "folds the image: two rays meet in one place"


def solid_angle_on_axis(camera: Camera) -> float:
    """Of a pixel on the boresight, over that of a lens with the focal length along rows and square
    axes."""
    area, distortion = 1.0, camera.lens.distortion
    if distortion is not None:
        boresight = np.array([[0.0, 0.0, 1.0]])
        area = float(distortion.area_per_steradian(boresight)[0]) / distortion.scale**2
    return 1.0 / (camera.lens.aspect * area)


def _on_pixels(camera: Camera) -> tuple[Array, Array]:
    """Unit lines of sight (height, width, 3) of the pixels in camera axes, and their solid angles
    (height, width) relative to that of one on the boresight; not finite where there are none.

    Smooth functions of the pixel: polynomials on a few nodes give them to the last digits of
    float64, a hundred times faster than the lens's own inverse at each pixel.
    """
    d = camera.detector
    before: Array | None = None
    for count in _NODES:
        nodes = chebyshev_nodes(count)
        x, y = 0.5 + nodes * (d.width - 1), 0.5 + nodes * (d.height - 1)
        values = _at_pixels(camera, *np.meshgrid(x, y))
        if not np.isfinite(values).all():
            break
        if before is not None:
            to_all = chebyshev_interpolation(len(before[0]), nodes)
            if np.abs(to_all @ before @ to_all.T - values).max() < _HALVED_ERROR:
                rows, columns = (
                    chebyshev_interpolation(count, np.linspace(0.0, 1.0, n))
                    for n in (d.height, d.width)
                )
                planes = [rows @ plane @ columns.T for plane in values]
                return np.stack(planes[:3], axis=-1), planes[3]
        before = values
    rays, solid_angle = np.empty((d.height, d.width, 3)), np.empty((d.height, d.width))
    for top in range(0, d.height, _ROWS):
        row, column = np.mgrid[top : min(top + _ROWS, d.height), 0 : d.width] + 0.5
        *axes, solid = _at_pixels(camera, column, row)
        rays[top : top + _ROWS] = np.stack(axes, axis=-1)
        solid_angle[top : top + _ROWS] = solid
    return rays, solid_angle


def _at_pixels(camera: Camera, column: Array, row: Array) -> Array:
    """(4, ...) unit ray and solid angle at pixel coordinates; not finite where there are none."""
    rays = camera.rays(np.stack([column, row], axis=-1))
    with np.errstate(all="ignore"):
        rays = rays / np.linalg.norm(rays, axis=-1, keepdims=True)
        area = rays[..., 2] ** -3
        if (distortion := camera.lens.distortion) is not None:
            area = distortion.area_per_steradian(rays) / distortion.scale**2
        solid_angle = 1.0 / (camera.lens.aspect * area)
    return np.concatenate([np.moveaxis(rays, -1, 0), solid_angle[None]])
