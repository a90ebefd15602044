"""A camera as data: pinhole geometry; the lens is in ``lens``, the pixels in ``detector``."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array
from simgl.camera.detector import Detector
from simgl.camera.lens import Lens
from simgl.camera.lidar import Lidar

__all__ = ["Camera", "Detector", "Lens"]


@dataclass(frozen=True, kw_only=True)
class Camera:
    """A named camera.

    exposure_time : [s]
    readout_time : from the end of exposure to the last row read [s]
    transport_latency : from the last row read to the image in flight software [s]
    lidar : flash LIDAR that uses the lens and the pixels; None for none
    """

    name: str
    lens: Lens
    detector: Detector
    exposure_time: float
    readout_time: float = 0.0
    transport_latency: float = 0.0
    lidar: Lidar | None = None

    @property
    def focal_length_px(self) -> float:
        """Focal length in pixels."""
        return self.lens.focal_length / self.detector.pixel_pitch

    @property
    def geometry(self) -> tuple[Hashable, ...]:
        """What determines where its pixels look, whatever their exposure and electronics."""
        d = self.detector
        return self.focal_length_px, d.width, d.height, self.lens.distortion

    @property
    def intrinsics(self) -> Array:
        """(3, 3) matrix from camera axes to homogeneous pixel coordinates.

        The centre of the pixel in column i, row j lies at (i + 0.5, j + 0.5); the principal point
        is the image centre.
        """
        f, d = self.focal_length_px, self.detector
        return np.array([[f, 0.0, 0.5 * d.width], [0.0, f, 0.5 * d.height], [0.0, 0.0, 1.0]])

    def project(self, points: Array) -> Array:
        """Pixel coordinates (..., 2) of points (..., 3) in camera axes, with lens distortion.

        NaN for points behind the camera.
        """
        with np.errstate(all="ignore"):
            tangents = points[..., :2] / points[..., 2:]
            if self.lens.distortion is not None:
                tangents = self.lens.distortion.distorted(tangents)
            tangents = np.where(points[..., 2:] > 0.0, tangents, np.nan)
        d = self.detector
        return tangents * self.focal_length_px + 0.5 * np.array([d.width, d.height])

    @property
    def fields_of_view(self) -> tuple[float, float]:
        """Full horizontal and vertical field of view [rad]."""
        d = self.detector
        half = np.array([d.width, d.height]) / (2.0 * self.focal_length_px)
        horizontal, vertical = 2.0 * np.arctan(half)
        return float(horizontal), float(vertical)
