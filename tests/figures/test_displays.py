"""Images with scales, and pixel values, are those of the arrays."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.arrays import AnyArray
from simgl.figures.displays import CameraImages, display, pixel_values, radiance_display
from tests.web.small_scene import HEIGHT, WIDTH, box_scenario


def images() -> CameraImages:
    camera = box_scenario().cameras["nav"]
    radiance = np.zeros((HEIGHT, WIDTH, 4), np.float32)
    radiance[10, 20] = [1.0, 2.0, 3.0, 4.0]
    depth = np.zeros((HEIGHT, WIDTH), np.float32)
    depth[5:, 30:] = 12.5
    dn = np.full((HEIGHT, WIDTH), 7, np.uint16)
    electrons = np.full((HEIGHT, WIDTH), 31.5, np.float32)
    planes: dict[str, AnyArray] = {
        "dn": dn,
        "radiance": radiance,
        "depth": depth,
        "electrons": electrons,
    }
    return CameraImages(camera=camera, planes=planes, saturated_share=0.0, seconds=0.01)


def test_a_pixel_is_read_in_column_and_row() -> None:
    values = pixel_values(images(), 20, 10)
    assert values is not None
    assert values["radiance_w_m2_sr"] == [1.0, 2.0, 3.0, 4.0]
    assert (values["dn"], values["electrons"], values["depth_m"]) == (7, 31.5, 0.0)


@pytest.mark.parametrize(("column", "row"), [(-1, 0), (WIDTH, 0), (0, HEIGHT), (0, -1)])
def test_there_is_no_pixel_outside_the_image(column: int, row: int) -> None:
    assert pixel_values(images(), column, row) is None


@pytest.mark.parametrize("brightest", [3e-5, 0.99, 1.0, 1.01, 2.1e7])
def test_the_scale_of_radiance_ends_at_the_next_power_of_ten(brightest: float) -> None:
    radiance = np.full((8, 8, 4), brightest / 4.0, np.float32)
    scale = radiance_display(radiance).scale
    assert scale is not None
    assert brightest <= scale.high * (1.0 + 1e-5) < 10.0 * brightest * (1.0 + 1e-5)
    assert np.log10(scale.high) == pytest.approx(round(np.log10(scale.high)), abs=1e-9)
    assert scale.unit == "W m-2 sr-1"


def test_false_colours_tell_radiance_by_its_place_on_the_scale() -> None:
    radiance = np.zeros((4, 4, 4), np.float32)
    radiance[:2, :, 0] = 100.0
    radiance[2, :, 0] = 10.0
    shown = radiance_display(radiance)
    assert shown.scale is not None
    of_scale = [tuple(bytes.fromhex(c[1:])) for c in shown.scale.colours]
    # A tenth of four decades below the top: three quarters of the bar, its seventh of nine colours.
    assert tuple(shown.pixels[0, 0]) == of_scale[8]
    assert tuple(shown.pixels[2, 0]) == of_scale[6]
    assert tuple(shown.pixels[3, 0]) == of_scale[0]


def test_depth_of_one_plate_has_a_scale_and_the_rest_has_none() -> None:
    shown = display(images(), "depth", 1600)
    assert shown is not None
    assert shown.scale is not None
    assert shown.scale.low == 12.5 < shown.scale.high
    assert not np.array_equal(shown.pixels[0, 0], shown.pixels[10, 40])


def test_wide_images_are_subsampled_and_missing_planes_are_none() -> None:
    shown = display(images(), "dn", 32)
    assert shown is not None
    assert shown.pixels.shape == (24, 32, 3)
    assert shown.jpeg()[:2] == b"\xff\xd8"
    assert display(images(), "light: sun", 32) is None


def test_a_black_image_can_be_shown() -> None:
    assert not np.isnan(radiance_display(np.zeros((4, 4, 4), np.float32)).pixels).any()
