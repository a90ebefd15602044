"""The air's radiance by an independent Monte Carlo: ``atmosphere.json`` beside this file.

Scalar multiple scattering in a spherical shell, float64, point Sun, Lambertian ground: the lighting
study's own parameters. Radiance factors are pi L / E of the Sun, with their standard errors.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from simgl.arrays import Array

BANDS = "RGB"


@dataclass(frozen=True, eq=False)
class Row:
    """One ray: camera place [m], view and Sun's direction, and (3,) values by column's name."""

    name: str
    sun_zenith_deg: float
    camera: Array
    view: Array
    sun: Array
    values: dict[str, Array]


def _document() -> dict[str, Any]:
    document: dict[str, Any] = json.loads(Path(__file__).with_suffix(".json").read_text("utf-8"))
    return document


def rows() -> list[Row]:
    """Every ray of the truth table."""
    return [
        Row(
            name=row["name"],
            sun_zenith_deg=row["sza"],
            camera=1e3 * np.array(row["cam_km"]),
            view=np.array(row["view"]),
            sun=np.array(row["sun"]),
            values={column: np.array([row[band][column] for band in BANDS]) for column in row["R"]},
        )
        for row in _document()["rows"]
    ]


def ground_irradiance() -> dict[float, dict[str, Array]]:
    """By the Sun's zenith angle [deg]: (3,) direct, diffuse_black, diffuse_a3, err."""
    table = _document()["ground_irradiance_over_E_sun"]
    return {
        float(angle): {
            key: np.array([table[band][angle][key] for band in BANDS]) for key in table["R"][angle]
        }
        for angle in table["R"]
    }


def plate_irradiance() -> dict[str, dict[str, Array]]:
    """By case: (3, 2) value and standard error over black ground and over ground of albedo 0.3."""
    table = _document()["plate_irradiance_at_500km_over_E_sun"]
    return {
        case: {
            ground: np.array([table[band][case][ground] for band in BANDS])
            for ground in table["R"][case]
        }
        for case in table["R"]
    }
