"""The lens in numpy, as the textbook writes it: what ``simgl.camera`` and its passes compute."""

from __future__ import annotations

import numpy as np
import scipy.fft

from simgl.arrays import Array
from simgl.camera.camera import Camera
from simgl.camera.diffraction import band_wavelengths, defocus_otf
from simgl.camera.lens import Blur
from simgl.camera.projections import Distortion
from simgl.physics.constants import SOLAR_TEMPERATURE


def image_irradiance(camera: Camera, radiance: Array) -> Array:
    """Irradiance of the image plane (height, width, 4) [W m-2], before the point spread.

    radiance : (height, width, 4) that the pixels see [W m-2 sr-1]
    """
    lens, d = camera.lens, camera.detector
    squared = 4.0 * lens.f_number**2 + (lens.camera_equation == "1+4N2")
    on_axis = np.pi * np.array(lens.transmission) / squared
    return radiance * on_axis * _off_axis(camera, d.width, d.height)[..., None]


def _off_axis(camera: Camera, width: int, height: int) -> Array:
    lens, f = camera.lens, camera.focal_length_px
    y, x = np.mgrid[0:height, 0:width] + 0.5
    tangents = np.stack([x - 0.5 * width, y - 0.5 * height], axis=-1) / f
    stretch = np.ones((height, width))
    if isinstance(lens.distortion, Distortion):
        tangents = lens.distortion.undistorted(tangents)
        stretch = np.linalg.det(lens.distortion.jacobian(tangents))
    angle = np.arctan(np.linalg.norm(tangents, axis=-1))
    if lens.vignetting.angles:
        return np.interp(angle, lens.vignetting.angles, lens.vignetting.relative)
    # cos^4 for a pinhole's picture; the same light on a stretched one is thinner.
    return np.cos(angle) ** 4 / stretch if lens.vignetting.natural else np.ones((height, width))


def point_spread(camera: Camera, blur: Blur, band: int, finer: int, size: int) -> Array:
    """(size, size) light of a point on pixels ``finer`` times as small as the detector's.

    Its middle is at [0, 0]; what reaches beyond the edges comes back at the other side.
    """
    lens, pitch = camera.lens, camera.detector.pixel_pitch / finer
    line = np.fft.fftfreq(size)
    table = np.linspace(0.0, _end(camera, band, pitch), 8192)
    transfer = np.exp(-2.0 * (np.pi * blur.aberration / pitch * table) ** 2)
    wavelengths, shares = band_wavelengths(SOLAR_TEMPERATURE)
    wave = np.zeros_like(table)
    for wavelength, share in zip(wavelengths[band], shares[band], strict=True):
        waves = blur.defocus / (8.0 * lens.f_number**2 * wavelength)
        wave += share * defocus_otf(table * wavelength * lens.f_number / pitch, waves)
    spectrum = np.zeros((size, size))
    aliases = np.arange(-int(np.ceil(table[-1])), int(np.ceil(table[-1])) + 1)
    for down in aliases:
        for across in aliases:
            v, u = (line + down)[:, None], line + across
            # Means over the small pixels.
            pixel = np.sinc(v) * np.sinc(u)
            spectrum += pixel * np.interp(np.hypot(v, u), table, transfer * wave, right=0.0)
    return np.asarray(np.fft.ifft2(spectrum).real)


def _end(camera: Camera, band: int, pitch: float) -> float:
    wavelengths, _ = band_wavelengths(SOLAR_TEMPERATURE)
    return pitch / (float(wavelengths[band].min()) * camera.lens.f_number)


def convolved(image: Array, kernel: Array) -> Array:
    """(height, width) image with each pixel spread by a kernel whose middle is at [0, 0].

    In float64, zero outside the image; the kernel is as large as image and spread together.
    """
    spectrum = scipy.fft.rfft2(image, s=kernel.shape) * scipy.fft.rfft2(kernel)
    whole = scipy.fft.irfft2(spectrum, s=kernel.shape)
    return whole[: image.shape[0], : image.shape[1]]
