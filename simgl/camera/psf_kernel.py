"""What a lens makes of a point, on the pixels of a detector: a sharp core and a wide tail.

A pixel of the radiance is already a mean over its area, so a kernel between pixels has to add the
lens and not the pixel once more. The samples of a point spread do that where it is wide; where it
is narrow they miss the light between them, and its means over a pixel (once for the pixel that
collects, twice with the pixel that shone) take their place. The kernel is the mixture of the three
whose transfer comes nearest to the lens's up to the detector's Nyquist frequency; none is negative.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.fft
from scipy.optimize import nnls

from simgl.arrays import Array
from simgl.camera.camera import Camera
from simgl.camera.diffraction import airy_tail, band_wavelengths, defocus_otf
from simgl.camera.lens import Blur
from simgl.errors import ConfigError
from simgl.physics.constants import SOLAR_TEMPERATURE

# Half width of the smallest core [pixels], and of the largest that is reasonable.
SMALLEST_REACH, LARGEST_REACH = 64, 512
# Points of the table of a transfer function between frequency 0 and its end.
_TABLE = 8192


@dataclass(frozen=True, eq=False)
class PsfKernel:
    """One band's point spread.

    core : (2 reach + 1, 2 reach + 1), fades to zero towards its edge; together with the tail sums
        to 1
    tail : of the point's light times r^3 in a pixel r [pixels] away, where the core has faded; 0
        where there is none
    """

    core: Array
    tail: float

    @property
    def reach(self) -> int:
        """Half width of the core [pixels]."""
        return int(self.core.shape[0]) // 2


def core_share(distance: Array, reach: int) -> Array:
    """Share of a kernel that its core holds: 1 to half the reach, 0 from the reach on [pixels]."""
    t = np.clip(2.0 * distance / reach - 1.0, 0.0, 1.0)
    return 0.5 + 0.5 * np.cos(np.pi * t)


def lens_transfer(camera: Camera, blur: Blur, band: int, frequency: Array) -> Array:
    """Optical transfer function of a lens in one band [per cycle per pixel].

    Diffraction by the f-number and the spectrum of sunlight in the band, defocus, and a Gaussian.
    """
    lens, pitch = camera.lens, camera.detector.pixel_pitch
    transfer = np.exp(-2.0 * (np.pi * blur.aberration / pitch * frequency) ** 2)
    if lens.spread is not None and lens.spread.diffraction:
        wavelengths, shares = band_wavelengths(SOLAR_TEMPERATURE)
        wave = np.zeros_like(transfer)
        for wavelength, share in zip(wavelengths[band], shares[band], strict=True):
            # Path difference at the pupil's edge: dz / (8 N^2).
            waves = blur.defocus / (8.0 * lens.f_number**2 * wavelength)
            cut_off = pitch / (wavelength * lens.f_number)
            wave += share * defocus_otf(frequency / cut_off, waves)
        transfer = transfer * wave
    return np.asarray(transfer)


def lens_reach(camera: Camera, blur: Blur) -> int:
    """Half width of the core that a blur needs [pixels].

    Raises ConfigError where it spreads over more pixels than can be convolved.
    """
    lens, pitch = camera.lens, camera.detector.pixel_pitch
    assert lens.spread is not None
    radius = (4.0 * blur.aberration + 0.5 * abs(blur.defocus) / lens.f_number) / pitch
    if lens.spread.diffraction:
        # The tail's law holds from some twenty dark rings on.
        radius += 20.0 * _mean_wavelength(1) * lens.f_number / pitch
    reach = SMALLEST_REACH
    while reach < 2.0 * radius:
        reach *= 2
    if reach > LARGEST_REACH:
        problem = (
            f"spreads a point over {2 * radius:.0f} pixels, at most {LARGEST_REACH} are possible"
        )
        raise ConfigError(f"[camera.{camera.name}]", "optics", problem)
    return int(reach)


def lens_kernel(camera: Camera, blur: Blur, band: int, reach: int) -> PsfKernel:
    """The point spread of a lens in one band at one blur."""
    lens, pitch = camera.lens, camera.detector.pixel_pitch
    assert lens.spread is not None
    tail = 0.0
    if lens.spread.diffraction:
        tail = airy_tail(_mean_wavelength(band), lens.f_number, pitch)
    if not lens.spread.diffraction and blur == Blur():
        point = np.zeros((2 * reach + 1, 2 * reach + 1))
        point[reach, reach] = 1.0
        return PsfKernel(point, 0.0)
    samples = _mixed(camera, blur, band, 4 * reach)
    offset = np.arange(-reach, reach + 1)
    distance = np.hypot(offset[:, None], offset)
    core = np.maximum(samples[np.ix_(offset, offset)], 0.0) * core_share(distance, reach)
    if tail == 0.0:
        # A Gaussian ends; what is left beyond it is the rounding of the table.
        core[core < 1e-9 * core.max()] = 0.0
    # Even to the last bit, so that its spectrum is real.
    core = core + core[::-1, ::-1]
    return PsfKernel(core * ((1.0 - tail_energy(tail, reach)) / core.sum()), tail)


def _mean_wavelength(band: int) -> float:
    wavelengths, shares = band_wavelengths(SOLAR_TEMPERATURE)
    return float(np.sum(wavelengths[band] * shares[band]))


def tail_energy(tail: float, reach: int) -> float:
    """The light in the tail of a kernel, over the whole plane."""
    # 2 pi integral of tail r^-2 (1 - core_share) dr, whose part beyond the reach is 2 pi tail / r.
    edge = np.linspace(0.5 * reach, reach, 513)
    middle = 0.5 * (edge[1:] + edge[:-1])
    near = np.sum(np.diff(edge) * (1.0 - core_share(middle, reach)) / middle**2)
    return float(2.0 * np.pi * tail * (near + 1.0 / reach))


def _mixed(camera: Camera, blur: Blur, band: int, size: int) -> Array:
    """(size, size) kernel whose centre is at [0, 0] and which repeats itself at its edges."""
    lens, pitch = camera.lens, camera.detector.pixel_pitch
    last = np.inf
    if lens.spread is not None and lens.spread.diffraction:
        wavelengths, _ = band_wavelengths(SOLAR_TEMPERATURE)
        last = pitch / (float(wavelengths[band].min()) * lens.f_number)
    if blur.aberration > 0.0:
        # exp(-2 (pi s f)^2) is below 1e-9 from here on.
        last = min(last, 1.03 * pitch / blur.aberration)
    frequency = np.linspace(0.0, last, _TABLE)
    table = lens_transfer(camera, blur, band, frequency)
    line = np.fft.rfftfreq(size)
    alias = np.arange(-int(np.ceil(last)), int(np.ceil(last)) + 1)
    spectra = np.zeros((3, len(line), len(line)))
    for down in alias:
        for across in alias:
            v, u = (line + down)[:, None], line + across
            both = np.interp(np.hypot(v, u), frequency, table, right=0.0)
            pixel = np.sinc(v) * np.sinc(u)
            spectra += both * np.stack([np.ones_like(pixel), pixel, pixel**2])
    # Where samples sum to something else than 1 it is the one in the middle that is not the mean.
    spectra += 1.0 - spectra[:, :1, :1]
    wanted = np.interp(np.hypot(line[:, None], line), frequency, table, right=0.0)
    # Frequencies along an axis and along the diagonal stand for all.
    axis, diagonal = (np.arange(len(line)), np.zeros(len(line), int)), (np.arange(len(line)),) * 2
    weights, _ = nnls(
        np.concatenate([spectra[:, *axis], spectra[:, *diagonal]], axis=1).T,
        np.concatenate([wanted[axis], wanted[diagonal]]),
    )
    weights /= weights.sum()
    quarter = np.tensordot(weights, spectra, 1)
    # The other half of the rows mirrors the first.
    half = np.concatenate([quarter, quarter[-2:0:-1]])
    return scipy.fft.irfft2(half, s=(size, size))


def image_kernel(image: Array, scale: int) -> PsfKernel:
    """The point spread that measured values describe.

    image : (rows, columns), 0 or more; its middle is the point
    scale : samples along the edge of a pixel
    """
    reach = SMALLEST_REACH
    while 2 * reach * scale < max(image.shape):
        reach *= 2
    down, across = (_binning(n, scale, reach) for n in image.shape)
    core = down @ image @ across.T
    return PsfKernel(core / core.sum(), 0.0)


def _binning(samples: int, scale: int, reach: int) -> Array:
    """(2 reach + 1, samples) share of each sample that falls into each pixel."""
    left = (np.arange(samples) - 0.5 * samples) / scale
    low = np.arange(-reach, reach + 1)[:, None] - 0.5
    overlap = np.minimum(low + 1.0, left + 1.0 / scale) - np.maximum(low, left)
    return np.maximum(overlap, 0.0) * scale
