"""A box on an orbit before a small camera, quick to draw."""

from __future__ import annotations

from typing import Any

from simgl import Scenario, scenario_from_dict

BOX = {"box": {"size_m": [2.0, 1.0, 1.0], "material": {"reflectance": 0.5}}}
WIDTH, HEIGHT = 64, 48


def box_scenario(**changes: Any) -> Scenario:
    """The scene, with other tables where given."""
    about = {"target": "box", "azimuth_deg": 30.0, "elevation_deg": 20.0, "range_m": 12.0}
    camera = {"about": about, "width_px": WIDTH, "height_px": HEIGHT, "focal_length_mm": 0.8}
    tables = {
        "epoch": {"utc": "2026-03-20T12:00:00"},
        "sun": {"direction_icrf": [0.6, 0.0, 0.8]},
        "earth": {"shape": "none"},
        "spacecraft": {
            "box": {"model": BOX, "orbit": {"altitude_km": 400.0, "inclination_deg": 51.6}}
        },
        "camera": {"nav": {**camera, "exposure_time_s": 0.0001}},
        "render": {"samples_per_pixel": 5},
    }
    return scenario_from_dict({**tables, **changes})
