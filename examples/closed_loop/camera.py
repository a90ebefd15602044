"""The camera as flight software knows it: geometry, dark level, what a full well is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from simgl_bridge.message_parts import CameraDescription

from simgl.arrays import Array


@dataclass(frozen=True, kw_only=True)
class Pinhole:
    """Geometry [px] and scale [DN]; pixel (column i, row j) has its centre at (i + 0.5, j + 0.5).

    pedestal_dn : the converter's offset
    full_scale_dn : the largest number
    """

    width: int
    height: int
    focal_length: float
    cx: float
    cy: float
    pedestal_dn: float
    full_scale_dn: float = 4095.0

    @classmethod
    def from_card(cls, card: CameraDescription) -> Pinhole:
        """The camera that an image server offers."""
        return cls(
            width=card.width,
            height=card.height,
            focal_length=card.focal_length_px,
            cx=card.cx,
            cy=card.cy,
            pedestal_dn=card.pedestal_dn,
            full_scale_dn=2.0**card.bits - 1.0,
        )

    def ray(self, point: tuple[float, float]) -> Array:
        """(3,) unit vector in camera axes through a point of the image (u, v) [px]."""
        u, v = point
        along = np.array([u - self.cx, v - self.cy, self.focal_length])
        return along / np.linalg.norm(along)

    def project(self, position_camera: Array) -> tuple[float, float]:
        """Point of the image (u, v) [px] where a position in camera axes appears."""
        u, v = self.project_all(position_camera[None])[0]
        return float(u), float(v)

    def project_all(self, positions_camera: Array) -> Array:
        """(n, 2) points of the image [px] where positions (n, 3) in camera axes appear."""
        plane = positions_camera[:, :2] / positions_camera[:, 2:]
        return plane * self.focal_length + [self.cx, self.cy]
