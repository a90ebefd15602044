"""Ramps between pixels: light that lies near a pixel's edge belongs to its neighbour, too."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.arrays import Array
from simgl.scenario.scenario import Scenario
from simgl.simulator import Product, Simulator
from tests.scenes import lambert, scene

FOCAL, PITCH, AWAY = 16e-3, 3.75e-6, 100.0
METRE = AWAY * PITCH / FOCAL

STANDING = {
    "preset": "ideal",
    "width_px": 64,
    "height_px": 64,
    "pixel_pitch_um": 1e6 * PITCH,
    "focal_length_mm": 1e3 * FOCAL,
    "exposure_time_s": 1e-3,
    "position_icrf_m": [0.0, 0.0, AWAY],
    "boresight": [0.0, 0.0, -1.0],
    "up": [0.0, 1.0, 0.0],
}


def plate_scene(width_px: float, samples: int | None, camera: dict[str, Any]) -> Scenario:
    """A tilted plate before black space."""
    model = {"width_m": width_px * METRE, "height_m": width_px * METRE, "material": lambert(0.5)}
    plate = {
        "model": {"plate": model},
        "position_icrf_m": [0.13 * METRE, 0.29 * METRE, 0.0],
        "quaternion_icrf_from_body_xyzw": [0.0, 0.0, np.sin(0.2), np.cos(0.2)],
    }
    render = {} if samples is None else {"samples_per_pixel": samples}
    return scene({"plate": plate}, {**STANDING, **camera}, render=render)


def plate_image(
    gl: moderngl.Context, ramp: float, *, width_px: float, samples: int | None, **camera: Any
) -> Array:
    """(64, 64) radiance in red."""
    scenario = plate_scene(width_px, samples, camera)
    with Simulator(scenario, gl) as simulator:
        still = simulator._still(scenario.at(scenario.epoch_tai_ns), "cam")
        return still._with_ramps((ramp,) * 4).read()[..., 0].astype(np.float64)


DISTORTED = {"optics": {"distortion": {"k1": -0.05}}}


@pytest.mark.parametrize(
    ("width_px", "samples", "camera"),
    [(20.0, 5, {}), (20.0, 80, {}), (20.0, 5, DISTORTED)],
    ids=["samples", "cells", "distorted"],
)
def test_a_ramp_moves_no_light_and_widens_by_its_own_variance(
    gl: moderngl.Context, width_px: float, samples: int | None, camera: dict[str, Any]
) -> None:
    sharp = plate_image(gl, 0.0, width_px=width_px, samples=samples, **camera)
    soft = plate_image(gl, 0.75, width_px=width_px, samples=samples, **camera)
    light = sharp.sum()
    # At five samples a pixel each of some 80 pixels on the outline has a tenth of a pixel of noise:
    # 0.9 of 400 pixels.
    assert soft.sum() == pytest.approx(light, rel=3e-3)
    at = np.arange(64) + 0.5
    for axis in (0, 1):
        lines, wide = sharp.sum(axis=axis), soft.sum(axis=axis)
        middle, wide_middle = lines @ at / light, wide @ at / soft.sum()
        assert wide_middle == pytest.approx(middle, abs=0.02)
        variance = lines @ (at - middle) ** 2 / light
        wide_variance = wide @ (at - wide_middle) ** 2 / soft.sum()
        # A square of the ramp's width has a variance of a twelfth of its square. 0.1 % of the
        # light, at the plate's edge, is 0.1 px^2.
        assert wide_variance - variance == pytest.approx(0.75**2 / 12.0, abs=0.1)


@pytest.mark.parametrize("camera", [{}, DISTORTED], ids=["pinhole", "distorted"])
def test_light_of_a_small_target_goes_to_the_pixels_around_it(
    gl: moderngl.Context, camera: dict[str, Any]
) -> None:
    """A hundredth of a pixel, 0.13 to the right of the corner of four pixels and 0.29 above it: of
    a ramp of 0.75 px, whose middle is the corner, 0.5 + 0.13 / 0.75 goes to the right."""
    image = plate_image(gl, 0.75, width_px=0.01, samples=None, **camera)
    right, above = 0.5 + 0.13 / 0.75, 0.5 + 0.29 / 0.75
    wanted = np.outer([above, 1.0 - above], [1.0 - right, right])
    np.testing.assert_allclose(image[31:33, 31:33] / image.sum(), wanted, atol=1e-4)
    sharp = plate_image(gl, 0.0, width_px=0.01, samples=None, **camera)
    assert image.sum() == pytest.approx(sharp.sum(), rel=1e-5)


def test_radiance_stays_sharp_when_electrons_are_softened(gl: moderngl.Context) -> None:
    lens = {"f_number": 4.0, "optics": {"diffraction": True}}
    sharp = plate_image(gl, 0.0, width_px=20.0, samples=5, **lens)
    scenario = plate_scene(20.0, 5, lens)
    with Simulator(scenario, gl) as simulator:
        state = scenario.at(scenario.epoch_tai_ns)
        capture = simulator.capture(state, "cam", {Product.ELECTRONS, Product.RADIANCE})
    assert capture.radiance is not None
    np.testing.assert_array_equal(capture.radiance.radiance[..., 0], sharp)


def test_no_sun_shines_through_the_edges_between_faces(gl: moderngl.Context) -> None:
    """Its disc behind a box is 50,000 times as bright as white paint: a last digit would show."""
    box = {
        "model": {"box": {"size_m": [90 * METRE] * 3, "material": lambert(0.5)}},
        "position_icrf_m": [0.0, 0.0, 0.0],
        "quaternion_icrf_from_body_xyzw": [0.2, 0.3, 0.1, 0.927361849549570],
    }
    render = {"samples_per_pixel": 5}
    scenario = scene({"box": box}, STANDING, sun_direction=(0.0, 0.0, -1.0), render=render)
    with Simulator(scenario, gl) as simulator:
        still = simulator._still(scenario.at(scenario.epoch_tai_ns), "cam")
        image = still._with_ramps((0.75,) * 4).read()
    assert image.max() == 0.0
