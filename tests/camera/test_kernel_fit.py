"""Kernels between softened pixels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simgl.arrays import Array
from simgl.camera.lens import Blur, PointSpread, Zone
from simgl.camera.pixel_ramp import SHARP, pixel_ramps
from simgl.camera.psf_kernel import lens_kernel, lens_reach, lens_transfer, tail_energy
from tests.camera.cameras import DIFFRACTION, camera


def transfer(core: Array, u: Array, v: Array) -> Array:
    """Of an even kernel, at pairs of frequencies [cycles per pixel]."""
    offset = np.arange(core.shape[0]) - core.shape[0] // 2
    across, down = (np.exp(2j * np.pi * np.multiply.outer(f, offset)) for f in (u, v))
    return np.einsum("fy,yx,fx->f", down, core, across).real


@pytest.mark.parametrize("normal", [0.0, 10.0, 30.0, 45.0])
@pytest.mark.parametrize("band", range(4))
@pytest.mark.parametrize("f_number", [1.4, 2.8, 4.0, 8.0])
def test_contrast_of_ramp_and_kernel_is_that_of_the_lens(
    f_number: float, band: int, normal: float
) -> None:
    """Across edges in all directions, in every band."""
    cam = camera(f_number=f_number, spread=DIFFRACTION)
    ramp, reach = pixel_ramps(cam)[band], lens_reach(cam, Blur())
    frequency = np.array([0.1, 0.25, 0.4, 0.5])
    u, v = frequency * np.cos(np.radians(normal)), frequency * np.sin(np.radians(normal))
    kernel = lens_kernel(cam, Blur(), band, reach, ramp)
    pixel = np.sinc(u) * np.sinc(v)
    actual = pixel * np.sinc(ramp * u) * np.sinc(ramp * v) * transfer(kernel.core, u, v)
    # What kernels without negative values leave. At f/8 the contrast of near infrared ends at 0.55
    # cycles per pixel, where no kernel follows it.
    wanted = pixel * lens_transfer(cam, Blur(), band, frequency)
    atol = 7e-3 if (f_number, band) == (8.0, 3) else 3e-3
    np.testing.assert_allclose(actual, wanted, atol=atol)
    assert kernel.core.min() >= 0.0
    light = kernel.core.sum() + tail_energy(kernel.tail, reach)
    assert light == pytest.approx(1.0, abs=1e-12)


# f-number, pitch, defocus [m] and error: light within a small part of a pixel, and in a disc of
# three pixels, whose contrast in blue has a zero near the Nyquist frequency.
OTHER_LENSES = [(2.8, 15e-6, 0.0, 2e-3), (4.0, 5.5e-6, -60e-6, 1e-2)]


@pytest.mark.parametrize(("f_number", "pitch", "defocus", "atol"), OTHER_LENSES)
def test_contrast_of_very_sharp_and_defocused_lenses(
    f_number: float, pitch: float, defocus: float, atol: float
) -> None:
    """Kernels without ramps are off by 0.008 before large pixels; a defocused lens needs wider
    ramps in blue than in red, the other way round than diffraction."""
    blur = Blur(defocus=defocus)
    cam = camera(f_number=f_number, spread=PointSpread(zones=(Zone(share=0.0, blur=blur),)))
    cam = replace(cam, detector=replace(cam.detector, pixel_pitch=pitch))
    ramps, frequency = pixel_ramps(cam), np.array([0.1, 0.25, 0.5])
    for band, ramp in enumerate(ramps):
        core = lens_kernel(cam, blur, band, lens_reach(cam, blur), ramp).core
        softened = np.sinc(ramp * frequency) * transfer(core, frequency, np.zeros(3))
        # Of the contrast behind pixels.
        error = np.sinc(frequency) * (softened - lens_transfer(cam, blur, band, frequency))
        assert np.abs(error).max() < atol


def test_wide_blur_and_sharp_or_measured_lenses_need_no_ramp() -> None:
    wide = PointSpread(diffraction=True, zones=(Zone(share=0.0, blur=Blur(aberration=8e-6)),))
    measured = PointSpread(image=((0.0, 1.0), (1.0, 2.0)))
    for spread in (None, wide, measured, PointSpread(diffraction=False)):
        assert pixel_ramps(camera(spread=spread)) == SHARP


def test_slower_lenses_have_wider_ramps() -> None:
    lenses = [pixel_ramps(camera(f_number=f, spread=DIFFRACTION)) for f in (1.4, 2.8, 4.0, 8.0)]
    for ramps in zip(*lenses, strict=True):
        assert list(ramps) == sorted(set(ramps))
        # Wider ones would see beyond a pixel's neighbours.
        assert 0.0 < ramps[0] < ramps[-1] <= 2.0
    for red, green, blue, infrared in lenses:
        # Diffraction goes with the wavelength.
        assert blue <= green <= red <= infrared
