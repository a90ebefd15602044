"""The field of view of a distorting lens, drawn by a pinhole camera and resampled; fall-off."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace

import numpy as np

from simgl.arrays import Array, Array32, IndexArray
from simgl.camera.camera import Camera
from simgl.errors import ConfigError
from simgl.lru_cache import MANY, LruCache

# Pixels around the field, for interpolation at its edges.
_MARGIN = 3
# Fields larger than this many times the image come from coefficients that do not fit the lens.
_LARGEST_FIELD = 3.0
# Pixels of an image with distortion: 8 GB for the lines of sight while they are computed.
_MAX_PIXELS = 1 << 25
# The background and the truth are drawn on pixels smaller than the detector's by this factor.
FINER = 2
# Of the arrays of cameras in the cache, by their geometry: exposures may change with each image.
_MAX_BYTES = 256 << 20


@dataclass(frozen=True, kw_only=True, eq=False)
class PinholeField:
    """The field of view of a distorting lens, as seen by a pinhole camera.

    pinhole : camera without distortion that covers the field, with the same focal length and pixels
    fine : the same with smaller pixels
    centred : ``fine`` with an odd number of pixels, so that one lies at the centre of each pixel
    places : (height, width, 2) centres of the camera's pixels in the pinhole's image [px]
    stretch : (height, width) area in the camera's image over area in the pinhole's
    """

    pinhole: Camera
    fine: Camera
    centred: Camera
    places: Array32
    stretch: Array

    @property
    def largest_pixel(self) -> tuple[float, float]:
        """Largest width and height of the camera's pixels in the pinhole's image [px]."""
        steps = (np.abs(np.diff(self.places, axis=axis)).sum(axis=-1) for axis in (1, 0))
        across, down = (float(step.max(initial=1.0)) for step in steps)
        return across, down


@dataclass(frozen=True, kw_only=True, eq=False)
class _FieldArrays:
    """The size of the pinhole's image, and the arrays of a ``PinholeField``."""

    width: int
    height: int
    places: Array32
    stretch: Array

    @property
    def nbytes(self) -> int:
        return self.places.nbytes + self.stretch.nbytes


_field_arrays = LruCache[tuple[Hashable, ...], _FieldArrays](MANY, max_bytes=_MAX_BYTES)


def field(camera: Camera) -> PinholeField:
    """The field of a camera whose lens has distortion.

    Raises ConfigError if the distortion is not invertible, or the field far exceeds a pinhole's.
    """
    arrays = _field_arrays.get(camera.geometry, lambda: _undistorted(camera), lambda a: a.nbytes)
    detector = replace(camera.detector, width=arrays.width, height=arrays.height)
    pinhole = replace(camera, lens=replace(camera.lens, distortion=None), detector=detector)
    return PinholeField(
        pinhole=pinhole,
        fine=_finer(pinhole, 0),
        centred=_finer(pinhole, 1),
        places=arrays.places,
        stretch=arrays.stretch,
    )


def _undistorted(camera: Camera) -> _FieldArrays:
    d, distortion = camera.detector, camera.lens.distortion
    assert distortion is not None
    where = f"[camera.{camera.name}]"
    if d.width * d.height > _MAX_PIXELS:
        problem = f"goes with at most {_MAX_PIXELS} pixels, got {d.width} x {d.height}"
        raise ConfigError(where, "optics.distortion", problem)
    f = camera.focal_length_px
    middle = 0.5 * np.array([d.width, d.height])
    y, x = np.mgrid[0 : d.height, 0 : d.width] + 0.5
    tangents = distortion.undistorted((np.stack([x, y], axis=-1) - middle) / f)
    if np.isnan(tangents).any():
        raise ConfigError(
            where, "optics.distortion", "folds the picture: two rays meet in one place"
        )
    reach = np.abs(tangents).max(axis=(0, 1)) * f
    if np.any(reach > _LARGEST_FIELD * middle):
        times = float((reach / middle).max())
        problem = f"sees {times:.1f} times the field of a pinhole, at most {_LARGEST_FIELD:g}"
        raise ConfigError(where, "optics.distortion", problem)
    width, height = (2 * (np.ceil(reach).astype(int) + _MARGIN)).tolist()
    places = tangents * f + 0.5 * np.array([width, height])
    return _FieldArrays(
        width=width,
        height=height,
        places=places.astype(np.float32),
        stretch=np.linalg.det(distortion.jacobian(tangents)),
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
    distortion, d, f = camera.lens.distortion, camera.detector, camera.focal_length_px
    assert distortion is not None
    star = pixels.astype(np.float64)
    pinhole, size = seen.pinhole.detector, np.array([d.width, d.height])
    tangent = (star / FINER - 0.5 * np.array([pinhole.width, pinhole.height])) / f
    star_pixel = np.floor(distortion.distorted(tangent) * f + 0.5 * size).astype(np.intp)
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
    d, f = pinhole.detector, pinhole.focal_length_px
    tangent = (places - 0.5 * np.array([d.width, d.height])) / f
    return (1.0 + (tangent**2).sum(axis=-1)) ** -1.5


def sight_lines(camera: Camera) -> Array:
    """(height, width, 3) lines of sight of the pixel centres in camera axes, z = 1."""
    d, f = camera.detector, camera.focal_length_px
    if camera.lens.distortion is None:
        y, x = np.mgrid[0 : d.height, 0 : d.width] + 0.5
        x, y = (x - 0.5 * d.width) / f, (y - 0.5 * d.height) / f
    else:
        seen = field(camera)
        pinhole = seen.pinhole.detector
        x, y = np.moveaxis(seen.places.astype(np.float64), -1, 0)
        x, y = (x - 0.5 * pinhole.width) / f, (y - 0.5 * pinhole.height) / f
    return np.stack([x, y, np.ones_like(x)], axis=-1)


def relative_illumination(camera: Camera) -> Array32:
    """(height, width) image-plane irradiance of a uniform radiance, relative to the axis."""
    vignetting, distortion = camera.lens.vignetting, camera.lens.distortion
    squared = (sight_lines(camera)[..., :2] ** 2).sum(axis=-1)
    stretch = 1.0 if distortion is None else field(camera).stretch
    if vignetting.angles:
        angle = np.arctan(np.sqrt(squared))
        return np.interp(angle, vignetting.angles, vignetting.relative).astype(np.float32)
    if not vignetting.natural:
        return np.ones(squared.shape, dtype=np.float32)
    return (1.0 / ((1.0 + squared) ** 2 * stretch)).astype(np.float32)
