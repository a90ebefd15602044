"""What a distorting lens does to light: its share in each pixel, and the lines of sight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from simgl.arrays import Array, Array32, IndexArray, Mask
from simgl.camera.camera import Camera
from simgl.camera.pinhole_fields import (
    FINER,
    PinholeField,
    pinhole_fields,
    solid_angle_on_axis,
)

# Of the warp, as in shaders/warp/warp.frag: spacing of its sample points in fine pixels, and the
# smallest and largest number of their rows and columns in a pixel.
_SPACING, _MIN_ROWS, _MAX_ROWS = 1.15, 2, 8
# A disc of such a radius [px] averages over how the warp weights fine pixels.
_LARGE_DISC = 10.0
# How much wider than on the boresight a fisheye shows it, at most.
_WIDENED = 3.0
# Cosine of the angle off a pinhole's boresight beyond which no pixel near is drawn through it.
_NEAR_A_PART = 0.08
# Places across the square about a smaller one at which its coverage of fine pixels is sampled.
_DISC_POINTS = 200
# Displacement of a point that changes what the warp keeps of its light, by 0.2 per pixel [px].
_NOTICEABLE = 0.005
# Widest triangle of a point [fine pixels]; pixels in the corners of a cube's faces have 6.
_WIDEST_POINT = 16.0


@dataclass(frozen=True, kw_only=True, eq=False)
class _WarpSamples:
    """Sample points of the warp in pixels, (...) each.

    middle, across, down : (..., 2) of a pixel in the pinhole's image, and its edges
    rows, columns : numbers of sample points in a pixel
    part : weight of a sample point, solid angle relative to that of an on-axis fine pixel; 0 where
        the pixel is drawn through another pinhole
    """

    middle: Array32
    across: Array32
    down: Array32
    rows: IndexArray
    columns: IndexArray
    part: Array


def _pixel_edges(seen: PinholeField, x: IndexArray, y: IndexArray) -> tuple[Array32, Array32]:
    """(..., 2) edges of the pixels in columns x and rows y along rows and columns, in the pinhole's
    image [px]."""
    height, width = seen.drawn.shape
    # One-sided at the edges, as in the shader.
    left, right = np.maximum(x - 1, 0), np.minimum(x + 1, width - 1)
    top, bottom = np.maximum(y - 1, 0), np.minimum(y + 1, height - 1)
    span_x = np.maximum(right - left, 1).astype(np.float32)[..., None]
    span_y = np.maximum(bottom - top, 1).astype(np.float32)[..., None]
    across = (seen.places[y, right] - seen.places[y, left]) / span_x
    down = (seen.places[bottom, x] - seen.places[top, x]) / span_y
    return across, down


def _warp_samples(seen: PinholeField, x: IndexArray, y: IndexArray) -> _WarpSamples:
    """Those of the pixels in columns x and rows y."""
    across, down = _pixel_edges(seen, x, y)
    rows, columns = (
        np.clip(
            np.ceil(np.linalg.norm(step, axis=-1) * FINER / _SPACING), _MIN_ROWS, _MAX_ROWS
        ).astype(np.intp)
        for step in (down, across)
    )
    return _WarpSamples(
        middle=seen.places[y, x],
        across=across,
        down=down,
        rows=rows,
        columns=columns,
        part=seen.drawn[y, x] * (FINER**2 * seen.solid_angle[y, x] / (rows * columns)),
    )


def _reach(seen: PinholeField) -> int:
    """Distance at which a point source may still contribute to a pixel [px]."""
    # A star's triangle reaches one pixel, one and a half where pixels are turned by 45 deg; a fine
    # pixel and interpolation add one and a half of those; half a pixel for its position.
    return int(np.ceil(2.0 + 1.5 / FINER / max(seen.smallest_step, 0.25)))


@dataclass(frozen=True, kw_only=True, eq=False)
class WarpedPoints:
    """What the warp does to point sources; nothing to those near the image's edges.

    share : (n,) factor on their light, drawn where ``drawn_points`` moves them
    offset : (n, 2) of their centroids in the camera's image, drawn where they are [px]
    """

    share: Array
    offset: Array


def warped_points(camera: Camera, rays: Array) -> WarpedPoints:
    """What the warp does to point sources.

    rays : (n, 3) towards them, camera axes. In a fine image each has the weights of
        shaders/stars/stars.frag, in the place and of the width of ``drawn_points``

    The sample points of the warp weight the fine pixels unequally, by some per cent. For extended
    sources this averages out, for a star it does not.
    """
    share, offset = _drawn_through_all(camera, rays, np.zeros((len(rays), 2)))
    moved = np.linalg.norm(offset, axis=1) > _NOTICEABLE
    share[moved], _ = _drawn_through_all(camera, rays[moved], offset[moved])
    return WarpedPoints(share=share, offset=offset)


def _drawn_through_all(camera: Camera, rays: Array, moved_by: Array) -> tuple[Array, Array]:
    """(n,) light and (n, 2) displacements [px] that the warp gives to point sources of light 1,
    drawn as if it displaced them by ``moved_by``; 1 and 0 near the image's edges."""
    complete, places = np.ones(len(rays), dtype=np.bool_), camera.project(rays)
    moments = np.zeros((3, len(rays)))
    for seen in pinhole_fields(camera):
        star, x, y = _windows(camera, seen, rays)
        inside = _on_seen_pixels(seen, x, y)
        complete &= inside
        moved, wide = drawn_points(camera, seen, rays[inside], moved_by[inside])
        x, y, star, place = x[inside], y[inside], star[inside] + moved, places[inside]
        # Of the pixels around a star those that are drawn here and see a fine pixel of it.
        off = np.abs(FINER * seen.places[y, x] - star[:, None])
        lit = np.all(off < 1.6 * wide[:, None] + 1.5, axis=-1) & seen.drawn[y, x]
        one, near = np.nonzero(lit)
        x, y = x[one, near], y[one, near]
        samples = _warp_samples(seen, x, y)
        rows, columns, total = samples.rows, samples.columns, np.zeros(len(one))
        for j, i in np.ndindex(int(rows.max(initial=0)), int(columns.max(initial=0))):
            v, u = (j + 0.5) / rows - 0.5, (i + 0.5) / columns - 0.5
            at = samples.middle + u[..., None] * samples.across + v[..., None] * samples.down
            at = FINER * at
            # Each fine pixel has the star's radiance by its own solid angle.
            light = _interpolated(at, star[one], wide[one]).prod(axis=-1)
            light /= _cosine_cubed(at / FINER, seen.pinhole)
            total += np.where((j < rows) & (i < columns), samples.part * light, 0.0)
        away = x + 0.5 - place[one, 0], y + 0.5 - place[one, 1]
        for moment, weight in zip(moments, (total, *(total * d for d in away)), strict=True):
            moment[inside] += np.bincount(one, weight, minlength=len(star))
    light, *first = np.where(complete, moments, [[1.0], [0.0], [0.0]])
    return light, np.stack(first, axis=-1) / light[:, None]


def drawn_points(
    camera: Camera, seen: PinholeField, rays: Array, offset: Array
) -> tuple[Array, Array]:
    """(n, 2) displacements of point sources in a fine image that move their centroids back by an
    offset, and (n, 2) full widths at half height of the triangles with which they are drawn, along
    its columns and rows [fine pixels].

    rays : (n, 3) towards them, camera axes
    offset : (n, 2) [px of the camera]

    The widths are those of the rectangle around one pixel of the camera. Narrower points fall
    between the sample points of the warp.
    """
    height, width = seen.drawn.shape
    x, y = _pixels_of(camera, rays).T
    across, down = _pixel_edges(seen, np.clip(x, 0, width - 1), np.clip(y, 0, height - 1))
    moved = -FINER * (offset[:, :1] * across + offset[:, 1:] * down)
    wide = FINER * (np.abs(across) + np.abs(down))
    return moved, np.clip(wide, 1.0, _WIDEST_POINT).astype(np.float64)


def _pixels_of(camera: Camera, rays: Array) -> IndexArray:
    """(n, 2) column and row of the pixels that see rays; far away where the lens sees nothing."""
    return np.floor(np.nan_to_num(camera.project(rays), nan=-1e6)).astype(np.intp)


def _windows(
    camera: Camera, seen: PinholeField, rays: Array
) -> tuple[Array, IndexArray, IndexArray]:
    """Of sources: (n, 2) where the fine image has them, and (n, k) columns and rows of the camera's
    pixels around them."""
    with np.errstate(all="ignore"):
        tangents = rays @ seen.R_pinhole_from_camera.T
        tangents = tangents[:, :2] / np.where(tangents[:, 2:] > 0.0, tangents[:, 2:], np.nan)
    pinhole, reach = seen.pinhole, _reach(seen)
    star = FINER * (tangents * pinhole.focal_length_px + np.array(pinhole.principal_point))
    pixel = _pixels_of(camera, rays)
    window = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    x, y = (pixel[:, k, None] + window[1 - k].ravel() for k in (0, 1))
    return star, x, y


def _on_seen_pixels(seen: PinholeField, x: IndexArray, y: IndexArray) -> Mask:
    """(n,) whether all pixels (n, k) lie in the image, where the lens images something."""
    height, width = seen.drawn.shape
    inside = np.all((x >= 0) & (x < width) & (y >= 0) & (y < height), axis=1)
    inside[inside] = np.all(seen.solid_angle[y[inside], x[inside]] > 0.0, axis=1)
    return inside


def warped_disc_share(camera: Camera, ray: Array, angular_radius: float) -> float:
    """Factor by which the warp changes the light of a small disc; 1 for one of many pixels.

    ray : (3,) unit, towards its centre in camera axes; angular_radius [rad]
    """
    in_image = angular_radius * camera.focal_length_px
    if in_image > _LARGE_DISC:
        return 1.0
    share = 0.0
    for seen in pinhole_fields(camera):
        centre = seen.R_pinhole_from_camera @ ray
        if centre[2] < _NEAR_A_PART:
            continue
        star, x, y = _windows(camera, seen, ray[None])
        reach = int(np.ceil(_WIDENED * in_image)) + _reach(seen)
        rows, columns = (
            np.arange(middle - reach, middle + reach + 1)
            for middle in (int(y[0, y.shape[1] // 2]), int(x[0, x.shape[1] // 2]))
        )
        y, x = np.meshgrid(rows, columns, indexing="ij")
        if not _on_seen_pixels(seen, x.reshape(1, -1), y.reshape(1, -1)).all():
            return 1.0
        if not seen.drawn[y, x].any():
            continue
        samples = _warp_samples(seen, x, y)
        half = FINER * seen.pinhole.focal_length_px * np.tan(angular_radius) / centre[2] ** 2
        corner = np.floor(star[0] - half) - 1.0
        size = int(2.0 * half) + 4
        coverage = _disc_coverage(seen, centre, angular_radius, corner, size)
        total, along, across = 0.0, samples.rows, samples.columns
        for j, i in np.ndindex(int(along.max()), int(across.max())):
            v, u = (j + 0.5) / along - 0.5, (i + 0.5) / across - 0.5
            at = samples.middle + u[..., None] * samples.across + v[..., None] * samples.down
            at = FINER * at - corner - 0.5
            light = scipy.ndimage.map_coordinates(
                coverage, np.moveaxis(at[..., ::-1], -1, 0), order=1, mode="constant"
            )
            total += float(np.sum(np.where((j < along) & (i < across), samples.part * light, 0.0)))
        places = _grid(corner, size, 1)
        share += total / float((coverage * _cosine_cubed(places, seen.pinhole)).sum())
    return share or 1.0


def _disc_coverage(
    seen: PinholeField, centre: Array, angular_radius: float, corner: Array, size: int
) -> Array:
    """(size, size) shares of fine pixels that a disc covers, from a corner's (column, row) on."""
    points = max(_DISC_POINTS // size, 4)
    rays = seen.pinhole.rays(_grid(corner, size, points))
    off = np.linalg.norm(np.cross(rays, centre), axis=-1) / np.linalg.norm(rays, axis=-1)
    covered = off < np.sin(angular_radius)
    return covered.reshape(size, points, size, points).mean(axis=(1, 3))


def _interpolated(at: Array, star: Array, wide: Array) -> Array:
    """A star's weights in fine pixels along either axis, interpolated at places, (..., 2) each."""
    low = np.floor(at - 0.5) + 0.5
    edges = [_left_of(low + step - star, wide) for step in (-0.5, 0.5, 1.5)]
    weight = at - low
    return (1.0 - weight) * (edges[1] - edges[0]) + weight * (edges[2] - edges[1])


def _left_of(off: Array, wide: Array) -> Array:
    """Share of a star's triangle below an offset from its place."""
    t = np.clip(off / wide, -1.0, 1.0)
    return 0.5 + t * (1.0 - 0.5 * np.abs(t))


def _cosine_cubed(places: Array, pinhole: Camera) -> Array:
    x, y = _tangents(places[..., 0], places[..., 1], pinhole)
    return (1.0 + x * x + y * y) ** -1.5


def _tangents(column: Array, row: Array, pinhole: Camera) -> tuple[Array, Array]:
    f, (x, y) = pinhole.focal_length_px, pinhole.principal_point
    return (column - x) / f, (row - y) / f


def _grid(corner: Array, size: int, points: int) -> Array:
    """Pixel coordinates (size x points, size x points, 2) in the pinhole's image of places in fine
    pixels, so many along an edge of each."""
    steps = (np.arange(size * points) + 0.5) / points
    return np.stack(np.meshgrid(corner[0] + steps, corner[1] + steps), axis=-1) / FINER


def sight_lines(camera: Camera) -> Array:
    """(height, width, 3) unit lines of sight of the pixel centres in camera axes; NaN where the
    lens sees nothing."""
    d = camera.detector
    if camera.is_pinhole:
        column, row = np.arange(float(d.width)), np.arange(float(d.height))
        x, y = _tangents(column + 0.5, row[:, None] + 0.5, camera)
        lines = np.stack(np.broadcast_arrays(x, y, 1.0), axis=-1)
        return lines / np.linalg.norm(lines, axis=-1, keepdims=True)
    lines = np.full((d.height, d.width, 3), np.nan)
    for seen in pinhole_fields(camera):
        places = seen.places[seen.drawn].astype(np.float64)
        x, y = _tangents(places[:, 0], places[:, 1], seen.pinhole)
        rays = np.stack([x, y, np.ones_like(x)], axis=-1) @ seen.R_pinhole_from_camera
        lines[seen.drawn] = rays / np.linalg.norm(rays, axis=-1, keepdims=True)
    return lines


def relative_illumination(camera: Camera) -> Array32:
    """(height, width) image-plane irradiance of a uniform radiance, relative to the axis of a lens
    with square pixels; 0 where the lens sees nothing.

    Two focal lengths make the solid angle of every pixel that of square ones over their ratio.
    """
    d, vignetting = camera.detector, camera.lens.vignetting
    if not vignetting.natural and not vignetting.angles:
        return np.full((d.height, d.width), solid_angle_on_axis(camera), dtype=np.float32)
    lines = sight_lines(camera)
    cosine = lines[..., 2]
    if vignetting.angles:
        angle = np.arctan2(np.hypot(lines[..., 0], lines[..., 1]), cosine)
        relative = np.interp(angle, vignetting.angles, vignetting.relative)
        relative *= solid_angle_on_axis(camera)
        return np.where(np.isnan(cosine), 0.0, relative).astype(np.float32)
    if camera.is_pinhole:
        return (cosine**4).astype(np.float32)
    solid_angle = pinhole_fields(camera)[0].solid_angle
    distortion = camera.lens.distortion
    if distortion is not None and distortion.pupil_turns:
        # A pupil square to its rays collects the solid angle of a pixel.
        return solid_angle.astype(np.float32)
    return (cosine * solid_angle).astype(np.float32)
