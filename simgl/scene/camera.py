"""A camera as data: pinhole geometry, lens and detector."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simgl.scene.detector import Detector

__all__ = ["Camera", "Detector", "Lens"]


@dataclass(frozen=True, kw_only=True)
class Lens:
    """focal_length [m]; f_number; transmission per band R, G, B, N, 0..1."""

    focal_length: float
    f_number: float
    transmission: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)


@dataclass(frozen=True, kw_only=True)
class Camera:
    """A named camera.

    exposure_time : [s]
    readout_time : from the end of exposure to the last row read [s]
    transport_latency : from there to where flight software has the image [s]
    """

    name: str
    lens: Lens
    detector: Detector
    exposure_time: float
    readout_time: float = 0.0
    transport_latency: float = 0.0

    @property
    def focal_length_px(self) -> float:
        """Focal length in pixels."""
        return self.lens.focal_length / self.detector.pixel_pitch

    @property
    def intrinsics(self) -> NDArray[np.float64]:
        """(3, 3) matrix from camera axes to pixel coordinates.

        The centre of the pixel in column i, row j lies at (i + 0.5, j + 0.5); the principal point
        is the middle of the image.
        """
        f, d = self.focal_length_px, self.detector
        return np.array([[f, 0.0, 0.5 * d.width], [0.0, f, 0.5 * d.height], [0.0, 0.0, 1.0]])

    @property
    def fields_of_view(self) -> tuple[float, float]:
        """Full horizontal and vertical field of view [rad]."""
        d = self.detector
        half = np.array([d.width, d.height]) / (2.0 * self.focal_length_px)
        horizontal, vertical = 2.0 * np.arctan(half)
        return float(horizontal), float(vertical)
