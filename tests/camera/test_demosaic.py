"""Development: demosaic, white balance, colour matrix."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.arrays import Array32
from simgl.camera.camera import Camera
from simgl.camera.demosaic import demosaic, develop, mosaic_masks
from simgl.camera.detector import ORDERS, Detector, Mosaic
from simgl.display_images import display_from_dn
from simgl.figures.displays import thumbnail_from_dn
from simgl.physics.spectrum import black_body_light
from tests.passes.exposures import camera

PHOTONS = black_body_light(1361.0, 5772.0).photon_irradiance


def colour_detector(order: str = "RGGB") -> Detector:
    mosaic = Mosaic(
        order=order,
        red=(0.30, 0.11, 0.02, 0.02),
        green=(0.05, 0.43, 0.13, 0.03),
        blue=(0.01, 0.07, 0.38, 0.02),
    )
    return colour_camera(mosaic).detector


def colour_camera(mosaic: Mosaic | None) -> Camera:
    return camera(width=64, height=48, mosaic=mosaic, bits=12, pedestal=64.0)


def mosaicked(rgb: Array32, order: str) -> Array32:
    """What one value a pixel is left of a picture in full colour."""
    masks = mosaic_masks(order, *rgb.shape[:2])
    return np.asarray(
        sum(rgb[..., i] * masks[letter] for i, letter in enumerate("RGB")), dtype=np.float32
    )


@pytest.mark.parametrize("order", ORDERS)
def test_planes_of_any_colour_come_back_exactly(order: str) -> None:
    """Malvar's filters are exact for linear pictures, with the same slopes in every colour."""
    y, x = np.mgrid[:40, :50].astype(np.float32)
    slope = 0.01 * x + 0.02 * y
    rgb = np.stack([0.5 + slope, 1.0 + slope, 0.2 + slope], axis=-1)
    got = demosaic(mosaicked(rgb, order), order)
    # Away from edges, where the mirror bends the plane; float32 sums of 13 terms.
    np.testing.assert_allclose(got[2:-2, 2:-2], rgb[2:-2, 2:-2], atol=2e-6)


@pytest.mark.parametrize("order", ORDERS)
def test_measured_values_stay_as_they_are(order: str) -> None:
    raw = np.random.default_rng(1).uniform(0.0, 1.0, (20, 30)).astype(np.float32)
    np.testing.assert_array_equal(mosaicked(demosaic(raw, order), order), raw)


def test_detail_without_colour_keeps_its_sharpness() -> None:
    """A grey edge: the gradients of the known colour sharpen the others, as bilinear does not."""
    grey = np.where(np.arange(32) < 16, 0.2, 0.8).astype(np.float32)
    rgb = np.repeat(np.broadcast_to(grey, (32, 32))[..., None], 3, axis=2)
    got = demosaic(mosaicked(rgb, "RGGB"), "RGGB")
    error = np.abs(got - rgb)[4:-4, 4:-4]
    # Of a step of 0.6, red at blue pixels misses 2.5 / 8; bilinear interpolation misses half.
    assert error.max() == pytest.approx(0.6 * 2.5 / 8.0, rel=1e-5)


@pytest.mark.parametrize("order", ORDERS)
def test_surfaces_show_the_colours_of_their_bands(order: str) -> None:
    """Uniform surfaces of one reflectance per band, N as R: linear sRGB is the reflectance."""
    detector = colour_detector(order)
    for reflectance in ((1.0, 1.0, 1.0), (0.8, 0.2, 0.1), (0.1, 0.7, 0.3), (0.3, 0.3, 0.9)):
        bands = np.array([*reflectance, reflectance[0]])
        square = np.array(detector.square) @ (bands * PHOTONS)
        # White in green pixels at a third of full scale, so that no colour is cut.
        white = np.array(detector.mosaic.green) @ PHOTONS if detector.mosaic else 1.0
        level = (detector.largest_dn - detector.pedestal) / 3.0
        dn = 64.0 + level * np.tile(square.reshape(2, 2) / white, (24, 32))
        linear = develop(np.round(dn).astype(np.uint16), detector, PHOTONS, gain=3.0)
        # DN are rounded at 1/1344 of white; the matrix and the balance enlarge that twofold.
        expected = np.broadcast_to(reflectance, linear.shape)
        np.testing.assert_allclose(linear, expected, atol=3e-3)


def test_what_is_saturated_is_white() -> None:
    detector = colour_detector()
    full = np.full((48, 64), 4095, dtype=np.uint16)
    linear = develop(full, detector, PHOTONS)
    np.testing.assert_allclose(linear / linear[0, 0, 1], 1.0, rtol=1e-5)


def test_a_monochrome_detector_shows_grey() -> None:
    cam = camera(width=3, height=1, bits=12, pedestal=95.0)
    dn = np.array([[95, 2095, 4095]], dtype=np.uint16)
    np.testing.assert_array_equal(display_from_dn(dn, cam)[0, :, 0], [0, 188, 255])
    assert np.ptp(display_from_dn(dn, cam), axis=-1).max() == 0


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("widest", [64, 31, 20, 9, 2])
def test_a_thumbnail_of_any_width_has_the_colours_of_its_image(order: str, widest: int) -> None:
    """A uniform surface: whatever is left out, each square keeps its pattern."""
    cam = colour_camera(colour_detector(order).mosaic)
    dn = np.zeros((48, 64), dtype=np.uint16)
    for letter, mask in mosaic_masks(order, 48, 64).items():
        dn[mask] = {"R": 900, "G": 700, "B": 300}[letter]
    shown = thumbnail_from_dn(dn, cam, widest)
    assert shown.shape[1] <= widest
    # The same arithmetic up to rounding.
    expected = display_from_dn(dn, cam)[24, 32].astype(int)
    assert np.abs(shown - expected).max() <= 1


def test_a_grey_thumbnail_has_pixels_of_its_image() -> None:
    cam = colour_camera(None)
    dn = np.arange(48 * 64, dtype=np.uint16).reshape(48, 64)
    shown = thumbnail_from_dn(dn, cam, 20)
    np.testing.assert_array_equal(shown, display_from_dn(dn, cam)[::4, ::4])
