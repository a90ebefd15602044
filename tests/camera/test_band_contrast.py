"""Diffraction in bands in which the response of the pixels, or a filter, varies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simgl.camera.camera import Camera
from simgl.camera.detector import Mosaic
from simgl.camera.diffraction import diffraction_mtf
from simgl.camera.lens import Blur
from simgl.camera.pixel_ramp import pixel_ramps
from simgl.camera.point_spread import spread_key
from simgl.camera.psf_kernel import lens_transfer
from simgl.camera.spectral_response import ResponseCurve
from simgl.physics.spectrum import BANDS, Bands, Curve
from tests.camera.cameras import DIFFRACTION, camera

# Of silicon, and of a filter of 20 nm whose curve was measured over 700 nm.
SILICON: Curve = ((300.0, 400.0, 550.0, 700.0, 1000.0, 1100.0), (0.1, 0.45, 0.77, 0.55, 0.05, 0.0))
LINE: Curve = ((400.0, 839.0, 841.0, 859.0, 861.0, 1100.0), (0.0, 0.0, 0.9, 0.9, 0.0, 0.0))
CASES: dict[str, Bands] = {
    "400-1000": Bands(names=("W",), edges=((400e-9, 1000e-9),)),
    "300-2500": Bands(names=("W",), edges=((300e-9, 2500e-9),)),
    "line": Bands(names=("W",), edges=((400e-9, 1100e-9),), filter=LINE),
    "RGBN": BANDS,
}


def seen_by(bands: Bands, f_number: float) -> Camera:
    cam = camera(f_number=f_number, spread=DIFFRACTION)
    curve = ResponseCurve(intervals=bands, factors=(SILICON,))
    return replace(cam, detector=replace(cam.detector, bands=bands, curve=curve))


@pytest.mark.parametrize("f_number", [1.4, 4.0, 8.0])
@pytest.mark.parametrize("name", CASES)
def test_contrast_is_that_of_the_electrons_in_a_band(name: str, f_number: float) -> None:
    """The mean over wavelengths in steps of 0.1 nm, by the formulas of Planck and Goodman."""
    bands, frequency = CASES[name], np.array([0.1, 0.25, 0.4, 0.5])
    cam = seen_by(bands, f_number)
    for index, (low, high) in enumerate(bands.edges):
        wavelength = np.arange(low, high, 1e-10) + 0.5e-10
        photons = wavelength**-4 / np.expm1(0.014387768775 / (wavelength * 5772.0))
        share = photons * np.interp(1e9 * wavelength, *SILICON, right=0.0)
        share *= bands.transmission(wavelength)
        mtf = diffraction_mtf(np.multiply.outer(frequency, wavelength) * f_number / 3.75e-6)
        wanted = mtf @ share / share.sum()
        found = lens_transfer(cam, Blur(), index, frequency)
        # Five wavelengths of a band, of which some are beyond their cut-off at f/8.
        np.testing.assert_allclose(found, wanted, atol=4e-3 if f_number == 8.0 else 1e-3)


def test_a_detector_of_colour_has_the_mean_of_its_pixels() -> None:
    """Narrow filters at 620, 540 and 460 nm before a band of 400 to 700 nm: two in green."""
    bands = Bands(names=("W",), edges=((400e-9, 700e-9),))
    curves = [
        ResponseCurve(intervals=bands, factors=(((at - 5.0, at, at + 5.0), (0.0, 1.0, 0.0)),))
        for at in (620.0, 540.0, 460.0)
    ]
    flat = (0.5, 0.0, 0.0, 0.0)
    mosaic = Mosaic(
        order="GRBG", red=flat, green=flat, blue=flat, curves=(curves[0], curves[1], curves[2])
    )
    cam = seen_by(bands, 4.0)
    cam = replace(cam, detector=replace(cam.detector, mosaic=mosaic))
    wavelength = np.array([620e-9, 540e-9, 460e-9])
    photons = wavelength**-4 / np.expm1(0.014387768775 / (wavelength * 5772.0))
    share = photons * (1.0, 2.0, 1.0)
    frequency = np.array([0.25, 0.5])
    mtf = diffraction_mtf(np.multiply.outer(frequency, wavelength) * 4.0 / 3.75e-6)
    found = lens_transfer(cam, Blur(), 0, frequency)
    np.testing.assert_allclose(found, mtf @ share / share.sum(), atol=1e-3)


def test_a_band_in_which_pixels_are_blind_has_a_spread_too() -> None:
    blind = ResponseCurve(intervals=BANDS, factors=(((400.0, 690.0), (0.5, 0.5)),))
    cam = camera(spread=DIFFRACTION)
    cam = replace(cam, detector=replace(cam.detector, curve=blind))
    found = lens_transfer(cam, Blur(), 3, np.array([0.0, 0.25]))
    assert found[0] == pytest.approx(1.0, abs=1e-12)
    assert found[1] == pytest.approx(diffraction_mtf(np.array(0.25 * 0.84 * 4.0 / 3.75)), abs=0.01)


def test_a_line_in_a_band_is_one_wavelength() -> None:
    line = ResponseCurve(intervals=BANDS, factors=(((649.4, 649.5, 649.6), (0.0, 1.0, 0.0)),))
    cam = camera(spread=DIFFRACTION)
    cam = replace(cam, detector=replace(cam.detector, curve=line))
    found = lens_transfer(cam, Blur(), 0, np.array([0.25]))
    assert found[0] == pytest.approx(
        diffraction_mtf(np.array(0.25 * 0.6495 * 4.0 / 3.75)), abs=1e-6
    )


def test_cameras_that_respond_otherwise_have_kernels_of_their_own() -> None:
    wide, other = seen_by(CASES["300-2500"], 4.0), camera(spread=DIFFRACTION)
    other = replace(other, detector=replace(other.detector, bands=CASES["300-2500"]))
    assert spread_key(wide, None, 0) != spread_key(other, None, 0)
    # Silicon sees no light beyond 1.1 um, whose spread is wide.
    assert pixel_ramps(wide)[0] < pixel_ramps(other)[0]
