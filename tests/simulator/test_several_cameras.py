"""Images of several cameras of one state are those of each camera alone."""

from __future__ import annotations

import moderngl
import numpy as np

import simgl
from simgl.scenario.scenario import Scenario
from simgl.simulator import Product, Simulator
from tests.scenes import lambert

BALL = {"sphere": {"radius_m": 1.0, "material": lambert(0.5)}}


def _scenario() -> Scenario:
    """A ball from three sides: two images of one size, and a larger one with row noise."""
    noisy = {"row_noise_e": 5.0}
    sides = {"front": (0.0, 96, {}), "right": (90.0, 96, {}), "back": (150.0, 128, noisy)}
    cameras = {
        name: {
            "about": {"target": "ball", "azimuth_deg": azimuth, "range_m": 9.0},
            "width_px": width,
            "height_px": 64,
            **more,
        }
        for name, (azimuth, width, more) in sides.items()
    }
    return simgl.scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "spacecraft": {"ball": {"model": BALL, "orbit": {"altitude_km": 400.0}}},
            "camera": cameras,
        }
    )


def test_images_that_are_under_way_together_are_those_of_each_camera(gl: moderngl.Context) -> None:
    one = _scenario()
    state = one.at(one.epoch_tai_ns)
    wanted = {
        "front": {Product.DN},
        "right": {Product.DN, Product.ELECTRONS, Product.RADIANCE},
        "back": {Product.DN, Product.TRUTH},
    }
    with Simulator(one, gl) as simulator:
        together = simulator.captures(state, wanted)
        alone = [simulator.capture(state, name, products) for name, products in wanted.items()]
        (radiance,) = simulator.captures(state, {"front": {Product.RADIANCE}})
        assert simulator.captures(state, {}) == ()
    assert radiance.digital is None
    assert radiance.radiance is not None
    for found, expected in zip(together, alone, strict=True):
        assert found.info.camera == expected.info.camera
        assert found.digital is not None
        assert expected.digital is not None
        np.testing.assert_array_equal(found.digital.dn, expected.digital.dn)
    _, right, back = together
    assert right.electrons is not None
    assert alone[1].electrons is not None
    np.testing.assert_array_equal(right.electrons.electrons, alone[1].electrons.electrons)
    assert back.truth is not None
    assert back.electrons is None
    # They look different, so that no image stands for another.
    front = together[0].digital
    assert front is not None
    assert right.digital is not None
    assert not np.array_equal(front.dn, right.digital.dn)
