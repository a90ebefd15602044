"""The field of view of a distorting lens, drawn by a pinhole camera and resampled; fall-off."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace

import numpy as np

from simgl.arrays import Array, Array32, IndexArray
from simgl.camera.camera import Camera
from simgl.camera.projections import Distortion
from simgl.errors import ConfigError
from simgl.lru_cache import MANY, LruCache

# Pixels around the field, for interpolation at its edges.
_MARGIN = 3
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
# which as many are enough [focal lengths]: that with all of them is about its square.
_NODES = (17, 33, 65, 129, 257)
_HALVED_ERROR = 1e-9
# Rows of pixels whose lines of sight are computed together where no polynomial fits.
_ROWS = 64


@dataclass(frozen=True, kw_only=True, eq=False)
class PinholeField:
    """The field of view of a distorting lens, as seen by a pinhole camera.

    pinhole : camera without distortion that covers the field; its pixels are square, and as large
        as the camera's on the boresight
    fine : the same with smaller pixels
    centred : ``fine`` with an odd number of pixels, so that one lies at the centre of each pixel
    places : (height, width, 2) centres of the camera's pixels in the pinhole's image [px]
    stretch : (height, width) area in the camera's image over area in the pinhole's
    reach : to which a pixel sees around its middle, at most [px of the pinhole]
    """

    pinhole: Camera
    fine: Camera
    centred: Camera
    places: Array32
    stretch: Array
    reach: int


@dataclass(frozen=True, kw_only=True, eq=False)
class _FieldArrays:
    """The size of the pinhole's image, and what a ``PinholeField`` has of its pixels."""

    width: int
    height: int
    places: Array32
    stretch: Array
    reach: int

    @property
    def nbytes(self) -> int:
        return self.places.nbytes + self.stretch.nbytes


_field_arrays = LruCache[tuple[Hashable, ...], _FieldArrays](MANY, max_bytes=_MAX_BYTES)


def field(camera: Camera) -> PinholeField:
    """The field of a camera that does not image as a pinhole.

    Raises ConfigError if the distortion is not invertible, or the field far exceeds a pinhole's.
    """
    arrays = _field_arrays.get(camera.geometry, lambda: _undistorted(camera), lambda a: a.nbytes)
    detector = replace(camera.detector, width=arrays.width, height=arrays.height)
    lens = replace(
        camera.lens,
        focal_length=camera.lens.focal_length * _scale(camera),
        distortion=None,
        aspect=1.0,
        skew=0.0,
        principal_offset=(0.0, 0.0),
    )
    pinhole = replace(camera, lens=lens, detector=detector)
    return PinholeField(
        pinhole=pinhole,
        fine=_finer(pinhole, 0),
        centred=_finer(pinhole, 1),
        places=arrays.places,
        stretch=arrays.stretch,
        reach=arrays.reach,
    )


def _scale(camera: Camera) -> float:
    distortion = camera.lens.distortion
    return 1.0 if distortion is None else distortion.scale


def _undistorted(camera: Camera) -> _FieldArrays:
    d, where = camera.detector, f"[camera.{camera.name}]"
    if d.width * d.height > _MAX_PIXELS:
        problem = f"goes with at most {_MAX_PIXELS} pixels, got {d.width} x {d.height}"
        raise ConfigError(where, "optics.distortion", problem)
    x, y, stretch = _on_pixels(camera)
    if not (stretch.min() > 0.0):  # also where it is no number
        raise ConfigError(where, "optics.distortion", _unseen(camera))
    middle = 0.5 * np.array([d.width, d.height])
    f = camera.focal_length_px * _scale(camera)
    reach = np.array([max(-tangent.min(), tangent.max()) for tangent in (x, y)]) * f
    if not np.all(reach <= _LARGEST_FIELD * middle):
        times = float((reach / middle).max())
        problem = f"sees {times:.1f} times the field of a pinhole, at most {_LARGEST_FIELD:g}"
        raise ConfigError(where, "optics.distortion", problem)
    width, height = (2 * (np.ceil(reach).astype(int) + _MARGIN)).tolist()
    places = np.empty((d.height, d.width, 2), dtype=np.float32)
    for k, (tangent, size) in enumerate(((x, width), (y, height))):
        places[..., k] = tangent * f + 0.5 * size
    return _FieldArrays(
        width=width, height=height, places=places, stretch=stretch, reach=_reach(places)
    )


def _reach(places: Array32) -> int:
    """Largest extent of a pixel in the pinhole's image: twice what it sees on either side.

    Every 16th row and column tells it well enough.
    """
    steps = np.diff(places[::16], axis=1), np.diff(places[:, ::16], axis=0)
    across, down = (np.abs(step).max(axis=(0, 1), initial=1.0) for step in steps)
    return int(np.ceil((across + down).max()))


def _unseen(camera: Camera) -> str:
    """What keeps a pinhole from drawing the field of a camera."""
    d = camera.detector
    across, down = (np.linspace(0.5, n - 0.5, 99) for n in (d.width, d.height))
    x, y, z = np.moveaxis(camera.rays(np.stack(np.meshgrid(across, down), axis=-1)), -1, 0)
    angle = float(np.nanmax(np.degrees(np.arctan2(np.hypot(x, y), z)), initial=0.0))
    if angle >= _WIDEST_DEG:
        return f"sees {angle:.0f} deg off the boresight; fields below {_WIDEST_DEG:g} deg are drawn"
    if isinstance(camera.lens.distortion, Distortion):
        return "folds the picture: two rays meet in one place"
    return "images nothing in the corners of the image; crop it to the field of the lens"


def _on_pixels(camera: Camera) -> tuple[Array, Array, Array]:
    """Tangents x / z and y / z of the pixels' lines of sight and the stretch, (height, width).

    Smooth functions of the pixel: polynomials on a few nodes give them to the last digits of
    float64, a hundred times faster than the lens's own inverse at each pixel.
    """
    d = camera.detector
    before: Array | None = None
    for count in _NODES:
        nodes = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, count))
        x, y = 0.5 + nodes * (d.width - 1), 0.5 + nodes * (d.height - 1)
        values = _at_pixels(camera, *np.meshgrid(x, y))
        if not np.isfinite(values).all():
            break
        if before is not None:
            to_all = _interpolation(len(before[0]), nodes)
            if np.abs(to_all @ before @ to_all.T - values).max() < _HALVED_ERROR:
                rows, columns = (
                    _interpolation(count, np.linspace(0.0, 1.0, n)) for n in (d.height, d.width)
                )
                first, second, stretch = (rows @ part @ columns.T for part in values)
                return first, second, stretch
        before = values
    result = np.empty((3, d.height, d.width))
    for top in range(0, d.height, _ROWS):
        row, column = np.mgrid[top : min(top + _ROWS, d.height), 0 : d.width] + 0.5
        result[:, top : top + _ROWS] = _at_pixels(camera, column, row)
    return result[0], result[1], result[2]


def _at_pixels(camera: Camera, column: Array, row: Array) -> Array:
    """(3, ...) tangents and stretch at pixel coordinates; not finite where there are none."""
    rays = camera.rays(np.stack([column, row], axis=-1))
    with np.errstate(all="ignore"):
        rays = np.where(rays[..., 2:] > 0.0, rays, np.nan)
        x, y = rays[..., 0] / rays[..., 2], rays[..., 1] / rays[..., 2]
        stretch = np.full(x.shape, camera.lens.aspect)
        if (distortion := camera.lens.distortion) is not None:
            cosine2 = 1.0 / (1.0 + x * x + y * y)
            area = distortion.area_per_steradian(rays) * cosine2 * np.sqrt(cosine2)
            stretch = stretch * area / distortion.scale**2
    return np.stack([x, y, stretch])


def _interpolation(count: int, places: Array) -> Array:
    """(n, count) from values at Chebyshev's nodes to their polynomial's at places in 0..1."""
    chebyshev = np.polynomial.chebyshev.chebvander
    nodes = -np.cos(np.linspace(0.0, np.pi, count))
    to_coefficients = np.linalg.inv(chebyshev(nodes, count - 1))
    return chebyshev(2.0 * places - 1.0, count - 1) @ to_coefficients


def _finer(pinhole: Camera, more: int) -> Camera:
    d = pinhole.detector
    fine = replace(
        d,
        width=FINER * d.width + more,
        height=FINER * d.height + more,
        pixel_pitch=d.pixel_pitch / FINER,
    )
    return replace(pinhole, detector=fine)


# Of the warp, as in shaders/warp/warp.frag: spacing of its sample points in fine pixels, and the
# smallest and largest number of their rows and columns in a pixel.
_SPACING, _MIN_ROWS, _MAX_ROWS = 1.15, 2, 8


@dataclass(frozen=True, kw_only=True, eq=False)
class _WarpSamples:
    """Sample points of the warp in each pixel, (height, width, ...).

    down, across : (2,) edges of a pixel in the pinhole's image
    rows, columns : numbers of sample points in a pixel
    part : weight of a sample point, solid angle relative to that of an on-axis fine pixel
    reach : distance at which a point source may still contribute to a pixel [px]
    """

    down: Array32
    across: Array32
    rows: IndexArray
    columns: IndexArray
    part: Array32
    reach: int

    @property
    def nbytes(self) -> int:
        arrays = self.down, self.across, self.rows, self.columns, self.part
        return sum(array.nbytes for array in arrays)


_cached_samples = LruCache[tuple[Hashable, ...], _WarpSamples](MANY, max_bytes=_MAX_BYTES)


def _warp_samples(camera: Camera) -> _WarpSamples:
    return _cached_samples.get(
        camera.geometry, lambda: _samples_of_warp(camera), lambda samples: samples.nbytes
    )


def _samples_of_warp(camera: Camera) -> _WarpSamples:
    seen = field(camera)
    # One-sided at the edges, as in the shader.
    down, across = (np.gradient(seen.places, axis=axis) for axis in (0, 1))
    lengths = [np.linalg.norm(step, axis=-1) for step in (down, across)]
    rows, columns = (
        np.clip(np.ceil(n * FINER / _SPACING), _MIN_ROWS, _MAX_ROWS).astype(np.intp)
        for n in lengths
    )
    cosine3 = _cosine_cubed(seen.places.astype(np.float64), seen.pinhole)
    part = FINER**2 / seen.stretch * cosine3 / (rows * columns)
    # A star covers 3 x 3 fine pixels, interpolation adds half a one; half a pixel for its position.
    reach = 2.0 / FINER / max(min(float(n.min()) for n in lengths), 0.25) + 0.5
    return _WarpSamples(
        down=down,
        across=across,
        rows=rows,
        columns=columns,
        part=part.astype(np.float32),
        reach=int(np.ceil(reach)),
    )


def warped_point_share(camera: Camera, pixels: Array32) -> Array:
    """(n,) factor by which the warp changes the light of point sources; 1 near the image's edges.

    pixels : (n, 2) positions in the fine image, where each point covers 3 x 3 pixels with the
        weights of shaders/stars/stars.frag

    The sample points of the warp weight the fine pixels unequally, by some per cent. For extended
    sources this averages out, for a star it does not.
    """
    seen, samples = field(camera), _warp_samples(camera)
    d = camera.detector
    star = pixels.astype(np.float64)
    star_pixel = np.floor(camera.project(seen.pinhole.rays(star / FINER))).astype(np.intp)
    window = np.mgrid[-samples.reach : samples.reach + 1, -samples.reach : samples.reach + 1]
    x, y = (star_pixel[:, k, None] + window[1 - k].ravel() for k in (0, 1))
    inside = np.all((x >= 0) & (x < d.width) & (y >= 0) & (y < d.height), axis=1)
    x, y, star = x[inside], y[inside], star[inside]
    rows, columns, part = samples.rows[y, x], samples.columns[y, x], samples.part[y, x]
    middle, across, down = seen.places[y, x], samples.across[y, x], samples.down[y, x]
    total = np.zeros(len(star))
    for j, i in np.ndindex(int(rows.max(initial=0)), int(columns.max(initial=0))):
        v, u = (j + 0.5) / rows - 0.5, (i + 0.5) / columns - 0.5
        at = FINER * (middle + u[..., None] * across + v[..., None] * down)
        light = _interpolated(at, star[:, None]).prod(axis=-1)
        total += np.sum(np.where((j < rows) & (i < columns), part * light, 0.0), axis=1)
    share = np.ones(len(pixels))
    share[inside] = total / _cosine_cubed(star / FINER, seen.pinhole)
    return share


def _interpolated(at: Array, star: Array) -> Array:
    """A star's weights in fine pixels along either axis, interpolated at places, (..., 2) each."""
    total = np.zeros(np.broadcast_shapes(at.shape, star.shape))
    for step in (-1.0, 0.0, 1.0):
        cell = np.floor(star) + step + 0.5
        off = np.abs(cell - star)
        part = np.where(off < 0.5, 0.75 - off * off, 0.5 * (1.5 - off) ** 2)
        total += part * np.maximum(1.0 - np.abs(at - cell), 0.0)
    return total


def _cosine_cubed(places: Array, pinhole: Camera) -> Array:
    x, y = _tangents(places[..., 0], places[..., 1], pinhole)
    return (1.0 + x * x + y * y) ** -1.5


def _tangents(column: Array, row: Array, pinhole: Camera) -> tuple[Array, Array]:
    f, (x, y) = pinhole.focal_length_px, pinhole.principal_point
    return (column - x) / f, (row - y) / f


def _sight_tangents(camera: Camera) -> tuple[Array, Array]:
    """x / z and y / z of the pixels' lines of sight, (height, width) each or broadcast to it."""
    d = camera.detector
    if camera.is_pinhole:
        column, row = np.arange(float(d.width)), np.arange(float(d.height))
        return _tangents(column + 0.5, row[:, None] + 0.5, camera)
    seen = field(camera)
    column, row = (seen.places[..., k].astype(np.float64) for k in (0, 1))
    return _tangents(column, row, seen.pinhole)


def sight_lines(camera: Camera) -> Array:
    """(height, width, 3) lines of sight of the pixel centres in camera axes, z = 1."""
    x, y = _sight_tangents(camera)
    z = np.ones((camera.detector.height, camera.detector.width))
    return np.stack([x * z, y * z, z], axis=-1)


def relative_illumination(camera: Camera) -> Array32:
    """(height, width) image-plane irradiance of a uniform radiance, relative to the axis."""
    vignetting = camera.lens.vignetting
    x, y = _sight_tangents(camera)
    squared = x * x + y * y
    stretch = 1.0 if camera.is_pinhole else field(camera).stretch
    if vignetting.angles:
        angle = np.arctan(np.sqrt(squared))
        return np.interp(angle, vignetting.angles, vignetting.relative).astype(np.float32)
    if not vignetting.natural:
        return np.ones(squared.shape, dtype=np.float32)
    distortion = camera.lens.distortion
    if distortion is not None and distortion.pupil_turns:
        # The solid angle of a pixel, which a pupil square to its rays collects.
        return (1.0 / ((1.0 + squared) ** 1.5 * stretch)).astype(np.float32)
    return (1.0 / ((1.0 + squared) ** 2 * stretch)).astype(np.float32)
