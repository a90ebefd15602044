"""A camera as data: pinhole geometry; the lens is in ``lens``, the pixels in ``detector``."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from simgl.arrays import Array
from simgl.camera.detector import Detector
from simgl.camera.event_sensor import EventSensor
from simgl.camera.infrared_detector import InfraredDetector
from simgl.camera.lens import Lens
from simgl.camera.lidar import Lidar
from simgl.physics.frames import angle_between
from simgl.value_checks import check_within

__all__ = ["Camera", "Detector", "Lens"]


@dataclass(frozen=True, kw_only=True)
class Camera:
    """A named camera.

    name : of the camera in its scenario
    lens, detector : optics and electronics
    exposure_time : [s]
    readout_time : from the end of exposure, of the middle row, to the last row read [s]
    transport_latency : from the last row read to the image in flight software [s]
    lidar : flash LIDAR that uses the lens and the pixels; None for none
    event_sensor : pixels of an event camera; None for none
    thermal : detector of thermal radiation; None for visible light

    Raises ValueError for a time below 0 or without a finite value.
    """

    name: str
    lens: Lens
    detector: Detector
    exposure_time: float
    readout_time: float = 0.0
    transport_latency: float = 0.0
    lidar: Lidar | None = None
    event_sensor: EventSensor | None = None
    thermal: InfraredDetector | None = None

    def __post_init__(self) -> None:
        for name in ("exposure_time", "readout_time", "transport_latency"):
            check_within(f'camera "{self.name}": {name}', getattr(self, name), 0.0)

    def with_margin(self, pixels: int) -> Camera:
        """The same camera with a larger image.

        pixels : more on each side
        """
        if pixels == 0:
            return self
        d = self.detector
        more = replace(d, width=d.width + 2 * pixels, height=d.height + 2 * pixels)
        return replace(self, detector=more)

    @property
    def focal_length_px(self) -> float:
        """Focal length along the image's rows in pixels."""
        return self.lens.focal_length / self.detector.pixel_pitch

    @property
    def principal_point(self) -> tuple[float, float]:
        """Where the boresight meets the image; column and row [px]."""
        d, (right, down) = self.detector, self.lens.principal_offset
        return 0.5 * d.width + right / d.pixel_pitch, 0.5 * d.height + down / d.pixel_pitch

    @property
    def geometry(self) -> tuple[Hashable, ...]:
        """Everything that determines the lines of sight, without exposure and electronics."""
        d, lens = self.detector, self.lens
        plane = self.focal_length_px, self.principal_point, lens.aspect, lens.skew
        return (*plane, d.width, d.height, lens.distortion)

    @property
    def is_pinhole(self) -> bool:
        """Whether it images directions like a pinhole with square pixels."""
        lens = self.lens
        return lens.distortion is None and lens.aspect == 1.0 and lens.skew == 0.0

    @property
    def intrinsics(self) -> Array:
        """(3, 3) matrix from the normalised image plane to homogeneous pixel coordinates.

        The centre of the pixel in column i, row j lies at (i + 0.5, j + 0.5). For a camera without
        distortion this is the projection of camera axes.
        """
        f, (x, y), lens = self.focal_length_px, self.principal_point, self.lens
        return np.array([[f, f * lens.skew, x], [0.0, f * lens.aspect, y], [0.0, 0.0, 1.0]])

    def project(self, points: Array) -> Array:
        """Pixel coordinates (..., 2), column and row, with lens distortion.

        points : (..., 3) in camera axes [m], or any other unit

        NaN for points that the lens does not see, such as those behind a pinhole.
        """
        if self.lens.distortion is not None:
            plane = self.lens.distortion.projected(points)
        else:
            with np.errstate(all="ignore"):
                tangents = points[..., :2] / points[..., 2:]
                plane = np.where(points[..., 2:] > 0.0, tangents, np.nan)
        return self.in_pixels(plane)

    def in_pixels(self, plane: Array) -> Array:
        """Pixel coordinates (..., 2), column and row.

        plane : (..., 2) points of the normalised image plane, x right and y down
        """
        x, y = plane[..., 0], plane[..., 1]
        sheared = np.stack([x + self.lens.skew * y, self.lens.aspect * y], axis=-1)
        return sheared * self.focal_length_px + np.array(self.principal_point)

    def on_plane(self, pixels: Array) -> Array:
        """Points (..., 2) of the normalised image plane, x right and y down.

        pixels : (..., 2) pixel coordinates, column and row
        """
        x, y = np.moveaxis((pixels - np.array(self.principal_point)) / self.focal_length_px, -1, 0)
        y = y / self.lens.aspect
        return np.stack([x - self.lens.skew * y, y], axis=-1)

    def rays(self, pixels: Array) -> Array:
        """Lines of sight (..., 3) in camera axes, of some length.

        pixels : (..., 2) pixel coordinates, column and row

        NaN where the lens sees nothing.
        """
        plane = self.on_plane(pixels)
        if self.lens.distortion is not None:
            return self.lens.distortion.rays(plane)
        return np.concatenate([plane, np.ones_like(plane[..., :1])], axis=-1)

    @cached_property
    def half_diagonal_angle(self) -> float:
        """From the boresight to the farthest corner of the image [rad]."""
        d, (x, y) = self.detector, self.principal_point
        if self.is_pinhole:
            corner = np.hypot(max(x, d.width - x), max(y, d.height - y))
            return float(np.arctan(corner / self.focal_length_px))
        corners = np.array([[i, j] for i in (0.0, d.width) for j in (0.0, d.height)])
        return max(self._angle(np.array([0.0, 0.0, 1.0]), corner) for corner in corners)

    def _angle(self, ray: Array, pixel: Array) -> float:
        """Between a ray and the line of sight at a pixel [rad]; the lens's widest where it sees
        nothing there."""
        seen = self.rays(pixel)
        if np.isnan(seen).any():
            lens = self.lens.distortion
            return 0.5 * np.pi if lens is None else lens.widest_angle
        return angle_between(seen, ray)

    @property
    def fields_of_view(self) -> tuple[float, float]:
        """Full horizontal and vertical field of view [rad], through the centre of the image."""
        d = self.detector
        if self.is_pinhole and self.lens.principal_offset == (0.0, 0.0):
            half = np.array([d.width, d.height]) / (2.0 * self.focal_length_px)
            horizontal, vertical = 2.0 * np.arctan(half)
            return float(horizontal), float(vertical)
        x, y = 0.5 * d.width, 0.5 * d.height
        ends = np.array([[0.0, y], [d.width, y], [x, 0.0], [x, d.height]])
        # Each side by itself: a field may exceed 180 deg.
        middle = self.rays(np.array([x, y]))
        left, right, top, bottom = (self._angle(middle, end) for end in ends)
        return left + right, top + bottom
