"""Cameras for tests of the lens."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from simgl.camera.camera import Camera, Detector, Lens
from simgl.camera.lens import PointSpread

DETECTOR = Detector(
    width=256,
    height=192,
    pixel_pitch=3.75e-6,
    quantum_efficiency=(0.6, 0.6, 0.6, 0.3),
    full_well=20000.0,
    read_noise=4.0,
    bits=12,
    pedestal=64.0,
    gain_dn_per_e=0.2,
)


def camera(width: int = 256, height: int = 192, **lens: Any) -> Camera:
    """A camera of f/4 and 8 mm, unless said otherwise."""
    return Camera(
        name="cam",
        lens=Lens(**{"focal_length": 8e-3, "f_number": 4.0, **lens}),
        detector=replace(DETECTOR, width=width, height=height),
        exposure_time=5e-4,
    )


DIFFRACTION = PointSpread(diffraction=True)
