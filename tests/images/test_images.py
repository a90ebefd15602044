"""Frames as people see them: transfer curve, white point, notebooks."""

from __future__ import annotations

import io
import tracemalloc

import moderngl
import numpy as np
from PIL import Image

from simgl.camera.demosaic import develop
from simgl.display_colours import WHITE_RADIANCE
from simgl.display_images import (
    contact_sheet,
    display_from_dn,
    display_from_radiance,
    display_gain,
    srgb_from_linear,
)
from tests.scenes import capture, lambert, scene


def test_srgb_has_its_published_values() -> None:
    linear = np.array([0.0, 0.0031308, 0.18, 0.5, 1.0, 7.0], dtype=np.float32)
    # IEC 61966-2-1: 18 % grey is code 118, 50 % is 188; brighter than white saturates.
    np.testing.assert_array_equal(srgb_from_linear(linear), [0, 10, 118, 188, 255, 255])


def test_a_white_surface_in_the_sun_is_white_and_a_grey_one_grey() -> None:
    white = np.array([154.439, 174.774, 171.947, 313.358], dtype=np.float32) / np.float32(np.pi)
    picture = display_from_radiance(np.stack([white, 0.18 * white])[None])
    np.testing.assert_allclose(picture[0, 0], 255, atol=1)
    np.testing.assert_allclose(picture[0, 1], 118, atol=1)


def test_every_frame_shows_itself_in_a_notebook(gl: moderngl.Context) -> None:
    ball = {"sphere": {"radius_m": 1.0, "material": lambert(0.8)}}
    scenario = scene(
        {"ball": {"model": ball, "position_icrf_m": [0, 0, 0]}},
        {"position_icrf_m": [0, 0, 90], "look_at": "ball", "exposure_time_s": 1e-4},
    )
    exposure = capture(gl, scenario)
    frames = (exposure, exposure.radiance, exposure.digital, exposure.electrons, exposure.truth)
    for frame in frames:
        assert frame is not None
        with Image.open(io.BytesIO(frame._repr_png_())) as picture:
            assert picture.size == (128, 128)
            pixels = np.asarray(picture.convert("L"))
        assert pixels[64, 64] > pixels[0, 0] + 50


def test_dn_shows_the_pedestal_black_and_full_scale_white() -> None:
    scenario = scene({}, {"position_icrf_m": [0, 0, 0], "boresight": [1, 0, 0]})
    dn = np.array([[0, 64, 4095]], dtype=np.uint16)
    picture = display_from_dn(dn, scenario.cameras["cam"])
    np.testing.assert_array_equal(picture[0, :, 0], [0, 0, 255])


def test_a_gain_is_the_power_of_two_that_keeps_the_picture_below_white() -> None:
    picture = np.zeros((10, 10, 4), dtype=np.float32)
    assert display_gain(picture) == 1.0
    # A tenth of the pixels at 0.3 of white: twice 0.3 fits, four times does not.
    picture[0, :, 1] = 0.3 * WHITE_RADIANCE[1]
    assert display_gain(picture) == 2.0
    assert display_gain(256.0 * picture) == 1.0 / 128.0


def test_a_contact_sheet_holds_the_pictures_row_by_row() -> None:
    shades = [10, 20, 30, 40]
    panels = {str(v): np.full((20, 40, 3), v, dtype=np.uint8) for v in shades}
    sheet = contact_sheet(panels, columns=3)
    assert sheet.shape == (2 * (20 + 11), 3 * 40, 3)
    for index, v in enumerate(shades):
        x, y = 40 * (index % 3), 31 * (index // 3) + 11
        assert np.all(sheet[y : y + 20, x : x + 40] == v)
        # Its name stands above it, black on white.
        assert sheet[y - 11 : y, x : x + 40].min() < 128
        assert sheet[y - 11 : y, x : x + 40].max() == 255
    assert np.all(sheet[31:, 40:] == 255)


def test_each_dn_of_a_grey_image_is_shown_as_development_says() -> None:
    """All 65,536 values of a detector of 12 bits whose numbers may be larger."""
    camera = scene({}, {"position_icrf_m": [0, 0, 0], "boresight": [1, 0, 0]}).cameras["cam"]
    dn = np.arange(65536, dtype=np.uint16).reshape(256, 256)
    expected = srgb_from_linear(develop(dn, camera.detector, np.ones(4), 2.0))
    np.testing.assert_array_equal(display_from_dn(dn, camera, 2.0), expected)


def test_a_large_image_is_displayed_strip_by_strip() -> None:
    # Three strips of 2^18 pixels, the last one shorter; each pixel by itself is the truth.
    radiance = np.random.default_rng(4).random((300, 2048, 4), dtype=np.float32) * np.float32(80.0)
    tracemalloc.start()
    seen = display_from_radiance(radiance)
    largest = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    for row in (0, 127, 128, 255, 256, 299):
        np.testing.assert_array_equal(seen[row], display_from_radiance(radiance[row : row + 1])[0])
    # The image and its strips have 3 bytes a pixel each; a strip takes 75 a pixel in between.
    assert largest < 2 * seen.nbytes + 80 * 2**18
