"""The detector's passes against the detector written down in numpy."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.arrays import Array
from simgl.camera.camera import Camera
from simgl.camera.detector import FixedPattern, Mosaic, Particles
from simgl.gpu.render_targets import Format, ImageTarget
from simgl.passes.exposure import ELECTRONS_FORMAT, ExposurePass
from tests.passes.exposures import EPOCH, camera, expose
from tests.reference import detector as reference

# Not a multiple of four: the last group of a row is cut.
WIDTH, HEIGHT = 211, 90
SIZE = {"width": WIDTH, "height": HEIGHT}

EFFECTS: dict[str, dict[str, Any]] = {
    "shot noise": {},
    "read noise": {"read_noise": 5.0},
    "dark current": {"dark_current_300k": 4e4, "temperature": 310.0},
    "prnu": {"pattern": FixedPattern(prnu=0.02)},
    "dead pixels": {"pattern": FixedPattern(dead_pixels=0.05)},
    "dsnu": {"pattern": FixedPattern(dsnu=6.0)},
    "rows and columns": {"pattern": FixedPattern(rows=6.0, columns=9.0)},
    "hot pixels": {"pattern": FixedPattern(hot_pixels=0.03, hot_current=3e5)},
    "row noise": {"row_noise": 7.0},
    "particles": {"particles": Particles(flux=3e12, depth=5e-6, charge=80e6)},
    "blooming": {"blooming": 0.8, "full_well": 800.0},
}
ALL: dict[str, Any] = {
    "read_noise": 5.0,
    "dark_current_300k": 4e4,
    "pattern": FixedPattern(
        prnu=0.02,
        dead_pixels=0.01,
        dsnu=6.0,
        rows=3.0,
        columns=4.0,
        hot_pixels=0.03,
        hot_current=3e5,
    ),
    "row_noise": 7.0,
    "particles": Particles(flux=3e12, depth=5e-6, charge=80e6),
    "blooming": 0.8,
    "full_well": 800.0,
    "gain_dn_per_e": 0.5,
    "bits": 10,
}


def light() -> Array:
    """(height, width) 0.05 to 5,000 e-."""
    mean = np.geomspace(0.05, 5000.0, WIDTH) * np.linspace(0.5, 1.0, HEIGHT)[:, None]
    return mean.astype(np.float32).astype(np.float64)


def compare(gl: moderngl.Context, cam: Camera, draw: int = 0) -> tuple[float, int]:
    """Share of the pixels that differ, and the largest difference [DN]."""
    got = expose(gl, light(), cam, seed=9, draw=draw).astype(np.int64)
    wanted = reference.digital(cam, light(), EPOCH, 9, draw).astype(np.int64)
    return float(np.mean(got != wanted)), int(np.abs(got - wanted).max())


@pytest.mark.parametrize("effect", EFFECTS)
def test_one_effect_alone_agrees(gl: moderngl.Context, effect: str) -> None:
    cam = camera(**SIZE, pedestal=100.0, serial=3, **EFFECTS[effect])
    share, largest = compare(gl, cam)
    # float32 against float64: errors of 1e-7 of a value, so 1e-4 of values that are mostly below
    # 1,000, cross an integer in as many pixels, and then by one.
    assert share < 2e-4
    assert largest <= 1


@pytest.mark.parametrize("draw", [0, 2**32 - 1])
def test_all_effects_together_agree(gl: moderngl.Context, draw: int) -> None:
    share, largest = compare(gl, camera(**SIZE, pedestal=100.0, serial=3, **ALL), draw)
    # Blooming passes a difference of one electron on to its neighbours.
    assert share < 4e-4
    assert largest <= 1


def test_what_needs_no_rounding_is_equal_to_the_bit(gl: moderngl.Context) -> None:
    """Full wells, offsets and gains that are whole, in a saturated picture."""
    cam = camera(**SIZE, pedestal=64.0, full_well=1000.0, gain_dn_per_e=2.0, bits=12)
    got = expose(gl, 1e6, cam, seed=9)
    np.testing.assert_array_equal(got, reference.digital(cam, np.full((90, 211), 1e6), EPOCH, 9))
    assert np.all(got == 2064)


@pytest.mark.parametrize("order", ["RGGB", "BGGR", "GRBG", "GBRG"])
def test_exposure_agrees_under_colour_filters(gl: moderngl.Context, order: str) -> None:
    mosaic = Mosaic(
        order=order,
        red=(0.5, 0.05, 0.02, 0.1),
        green=(0.04, 0.6, 0.07, 0.11),
        blue=(0.01, 0.08, 0.55, 0.12),
    )
    cam = camera(**SIZE, mosaic=mosaic, fill_factor=0.7)
    photons = np.array([3.3e18, 2.8e18, 2.3e18, 4.2e18])
    irradiance = np.random.default_rng(1).uniform(0.0, 2.0, (HEIGHT, WIDTH, 4)).astype(np.float32)
    source = ImageTarget(gl, (WIDTH, HEIGHT), [Format("f4", 4)])
    target = ImageTarget(gl, (WIDTH, HEIGHT), [ELECTRONS_FORMAT])
    exposure = ExposurePass(gl)
    source.textures[0].write(irradiance.tobytes())
    exposure.draw(cam, photons, source.textures[0], target.framebuffer)
    got = target.read()
    gl.detect_framebuffer(0).use()
    for resource in (source, target, exposure):
        resource.release()
    # Four products in float32.
    wanted = reference.mean_electrons(cam, irradiance.astype(np.float64), photons)
    np.testing.assert_allclose(got, wanted, rtol=1e-6)
    # Red light alone lands where the order says: 0.5 of its photons.
    red = np.zeros((2, 2, 4))
    red[..., 0] = 1.0
    seen = reference.mean_electrons(cam, red, photons)
    assert order[int(seen.argmax())] == "R"
    area_time = 25e-12 * 0.7 * cam.exposure_time
    np.testing.assert_allclose(seen.max(), area_time * 3.3e18 * 0.5, rtol=1e-12)
