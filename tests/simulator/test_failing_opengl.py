"""An error of OpenGL costs the frame that it meets, and nothing after it."""

from __future__ import annotations

import hashlib

import numpy as np

from simgl.scenario.loader import scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.simulator import Product, Simulator
from tests.scenes import Table, lambert

PRODUCTS = frozenset({Product.DN, Product.RADIANCE, Product.TRUTH})


def busy_scene(*, seed: int, azimuth_deg: float) -> Scenario:
    """A scene that needs every pass: clouds by a seed, two bodies, lamp, stars, a lens with all."""
    plate: Table = {"plate": {"width_m": 2.0, "height_m": 2.0, "material": lambert(0.6)}}
    box: Table = {"box": {"size_m": [1.0, 1.0, 1.0], "material": "mli_gold"}}
    relative: Table = {"relative_to": "box", "position_lvlh_m": [0.0, 0.9, 0.9]}
    camera: Table = {
        "preset": "cmv4000",
        "width_px": 128,
        "height_px": 96,
        "focal_length_mm": 4.0,
        "about": {
            "target": "box",
            "azimuth_deg": azimuth_deg,
            "elevation_deg": 20.0,
            "range_m": 4.0,
        },
        "optics": {"distortion": {"k1": -0.05}, "aberration_um": 5.0},
        "blooming": 0.5,
    }
    lamp: Table = {
        "on": "box",
        "position_body_m": [0.0, 0.0, 1.0],
        "boresight": [0, 0, -1],
        "half_angle_deg": 40.0,
        "power_w": [30.0] * 4,
    }
    return scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "earth": {"clouds": {"seed": seed}},
            "spacecraft": {
                "box": {"model": box, "orbit": {"altitude_km": 400.0}},
                "plate": {"model": plate, **relative},
            },
            "camera": {"cam": camera},
            "lamp": {"spot": lamp},
        }
    )


def digest(simulator: Simulator, scenario: Scenario) -> str:
    capture = simulator.capture(scenario.at(scenario.epoch_tai_ns), "cam", PRODUCTS)
    assert capture.digital is not None
    assert capture.radiance is not None
    assert capture.truth is not None
    h = hashlib.sha256()
    for array in (capture.digital.dn, capture.radiance.radiance, capture.truth.depth):
        h.update(np.ascontiguousarray(array).tobytes())
    return h.hexdigest()
