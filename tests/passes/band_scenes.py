"""Scenes over the Earth by a camera in bands of its own."""

from __future__ import annotations

from typing import Any

from tests.scenes import Table

ORBIT = 6778e3


def over_earth(
    boresight: list[float], up: list[float], bands: list[list[float]] | None, **tables: Any
) -> Table:
    """A scene 400 km over the equator, by a camera of 96 x 72 pixels.

    bands : their edges [nm]; None for the default's
    """
    camera = {
        "position_icrf_m": [ORBIT, 0.0, 0.0],
        "boresight": boresight,
        "up": up,
        "width_px": 96,
        "height_px": 72,
        "focal_length_mm": 12.0,
        "pixel_pitch_um": 20.0,
        "f_number": 4.0,
        "exposure_time_s": 1e-4,
        "quantum_efficiency": 0.5,
    }
    scene: Table = {"epoch": {"utc": "2026-03-20T12:00:00"}, "camera": {"cam": camera}, **tables}
    if bands is not None:
        scene["bands"] = {"edges_nm": bands}
    return scene
