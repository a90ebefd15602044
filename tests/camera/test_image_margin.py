"""Light that a lens brings into the image from beyond its edges."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.arrays import Array
from simgl.camera.image_margin import image_margin
from simgl.camera.lens import Blur, PointSpread, Zone
from simgl.camera.projections import Distortion
from simgl.simulator import Product, Simulator
from tests.camera.cameras import DIFFRACTION, camera
from tests.scenes import lambert, scene

_PITCH, _FOCAL, _AWAY = 3.75e-6, 16e-3, 100.0
_METRE = _AWAY * _PITCH / _FOCAL


def electrons(
    gl: moderngl.Context, plate_px: float, corner: tuple[float, float], more: int, **keys: Any
) -> Array:
    """Of a plate whose upper left corner lies at a pixel, by a camera of 96 x 80 pixels and more
    on each side; without those."""
    size = np.array([96.0, 80.0])
    x, y = (np.array(corner) + 0.5 * plate_px - 0.5 * size) * _METRE
    plate = {"width_m": plate_px * _METRE, "height_m": plate_px * _METRE, "material": lambert(0.5)}
    width, height = (size.astype(int) + 2 * more).tolist()
    scenario = scene(
        {"plate": {"model": {"plate": plate}, "position_icrf_m": [float(x), -float(y), 0.0]}},
        {
            "preset": "imx264_colour",
            "width_px": width,
            "height_px": height,
            "pixel_pitch_um": 1e6 * _PITCH,
            "focal_length_mm": 1e3 * _FOCAL,
            "exposure_time_s": 1e-3,
            "position_icrf_m": [0.0, 0.0, _AWAY],
            "boresight": [0.0, 0.0, -1.0],
            "up": [0.0, 1.0, 0.0],
            **keys,
        },
        render={"samples_per_pixel": 45},
    )
    with Simulator(scenario, gl) as simulator:
        state = scenario.at(scenario.epoch_tai_ns)
        frame = simulator.capture(state, "cam", {Product.ELECTRONS}).electrons
    assert frame is not None
    image = frame.electrons.astype(np.float64)
    return image[more : height - more, more : width - more]


# Of a uniform image 0.5 % of a pixel's light comes from farther away than is drawn, at the edges.
LENSES: dict[str, dict[str, Any]] = {
    "f/2.8": {"f_number": 2.8, "optics": {"diffraction": True}},
    "f/8": {"f_number": 8.0, "optics": {"diffraction": True}},
    "aberration": {"f_number": 4.0, "optics": {"aberration_um": 6.0}},
    "defocus": {"f_number": 2.8, "optics": {"diffraction": True, "defocus_um": 40.0}},
    "barrel": {
        "f_number": 4.0,
        "optics": {"diffraction": True, "distortion": {"k1": -0.3}},
    },
    "fisheye": {
        "f_number": 4.0,
        "optics": {"diffraction": True, "distortion": {"model": "fisheye"}},
    },
}


@pytest.mark.parametrize("name", LENSES)
def test_an_even_image_is_even_to_its_edges(gl: moderngl.Context, name: str) -> None:
    optics = {"vignetting": "none", **LENSES[name]["optics"]}
    image = electrons(gl, 4000.0, (-1900.0, -1900.0), 0, **{**LENSES[name], "optics": optics})
    for row, column in ((0, 0), (0, 1), (1, 0), (1, 1)):
        colour = image[row::2, column::2]
        # In a corner twice as much comes from afar.
        np.testing.assert_allclose(colour, np.median(colour), rtol=1e-2)
        np.testing.assert_allclose(colour[8:-8, 0], np.median(colour), rtol=5e-3)


@pytest.mark.parametrize("name", ["f/8", "aberration", "barrel"])
@pytest.mark.parametrize("corner", [(88.0, 60.0), (97.0, 30.0), (-9.5, -9.0)])
def test_an_image_is_part_of_a_larger_one(
    gl: moderngl.Context, name: str, corner: tuple[float, float]
) -> None:
    """Of a plate that is partly, or all of it, beyond the edge."""
    small = electrons(gl, 10.0, corner, 0, **LENSES[name])
    large = electrons(gl, 10.0, corner, 64, **LENSES[name])
    assert small.sum() == pytest.approx(large.sum(), abs=0.005 * 100.0 * large.max())
    # Behind a lens that distorts, edges lie where 45 samples a pixel put them.
    atol = 0.02 if name == "barrel" else 0.005
    np.testing.assert_allclose(small, large, atol=atol * large.max())


def test_moving_images_have_the_same_margin(gl: moderngl.Context) -> None:
    """An even plate that moves by 20 px within the exposure."""
    optics = {"diffraction": True, "vignetting": "none"}
    plate = {"width_m": 4e3 * _METRE, "height_m": 4e3 * _METRE, "material": lambert(0.5)}
    scenario = scene(
        {
            "plate": {
                "model": {"plate": plate},
                "position_icrf_m": [0.0, 0.0, 0.0],
                "velocity_icrf_m_s": [2e4 * _METRE, 0.0, 0.0],
            }
        },
        {
            "preset": "ideal",
            "width_px": 96,
            "height_px": 80,
            "pixel_pitch_um": 1e6 * _PITCH,
            "focal_length_mm": 1e3 * _FOCAL,
            "f_number": 4.0,
            "exposure_time_s": 1e-3,
            "position_icrf_m": [0.0, 0.0, _AWAY],
            "boresight": [0.0, 0.0, -1.0],
            "up": [0.0, 1.0, 0.0],
            "optics": optics,
        },
    )
    with Simulator(scenario, gl) as simulator:
        epoch = scenario.epoch_tai_ns
        during = scenario.around(epoch)
        captured = simulator.capture(scenario.at(epoch), "cam", {Product.ELECTRONS}, during=during)
    assert captured.electrons is not None
    image = captured.electrons.electrons.astype(np.float64)
    np.testing.assert_allclose(image, np.median(image), rtol=1e-2)


def test_margins_grow_with_the_spread_and_are_whole_squares_of_filters() -> None:
    margins = [image_margin(camera(f_number=f, spread=DIFFRACTION)) for f in (1.4, 4.0, 16.0)]
    assert 0 < margins[0] < margins[1] < margins[2] <= 64
    blurred = PointSpread(diffraction=False, zones=(Zone(share=0.0, blur=Blur(aberration=15e-6)),))
    # Three deviations of 4 px, ramp and half a pixel.
    assert image_margin(camera(spread=blurred)) == 16
    assert all(margin % 4 == 0 for margin in margins)


@pytest.mark.parametrize("samples", [1, 2])
def test_the_margin_of_a_measured_spread_holds_its_light(samples: int) -> None:
    """A square of 20 samples, in an image of which most is dark."""
    image = np.zeros((200, 200))
    image[90:110, 90:110] = 1.0
    spread = PointSpread(image=tuple(map(tuple, image.tolist())), image_scale=samples)
    assert image_margin(camera(spread=spread)) == {1: 12, 2: 8}[samples]


def test_a_sharp_lens_needs_no_margin() -> None:
    for spread in (None, PointSpread(diffraction=False)):
        assert image_margin(camera(spread=spread)) == 0
    assert image_margin(camera(veiling_glare=0.1)) == 0


def test_a_lens_that_sees_no_farther_has_no_margin() -> None:
    """Its formula folds a few pixels beyond the image's corner."""
    cam = camera(640, 480, spread=DIFFRACTION, distortion=Distortion(k1=-0.2))
    assert image_margin(cam) > 0
    corner = np.hypot(320.0, 240.0) * 3.75e-6 / 8e-3
    # r (1 - k r^2) turns back at r^2 = 1 / 3k, where its picture is 2/3 of that r away.
    k = 4.0 / 27.0 / (1.004 * corner) ** 2
    folded = replace(cam, lens=replace(cam.lens, distortion=Distortion(k1=-k)))
    assert image_margin(folded) == 0
