"""Point spread of a lens as a kernel between pixels: a core, and a tail as r^-3.

Radiance pixels are already averaged over the pixel, so the kernel models the lens only. Samples of
the point spread do that if it is wide. If it is narrow they miss light between them; then its means
over a pixel, once and twice, are better. The kernel is the mixture of the three with non-negative
weights whose MTF is closest to the lens's up to the detector's Nyquist frequency. Where pixels are
softened by a ramp, its middle is then fitted to that MTF pixel by pixel (``kernel_fit``).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy

from simgl.arrays import Array
from simgl.camera.camera import Camera
from simgl.camera.chebyshev import chebyshev_interpolation, chebyshev_nodes
from simgl.camera.diffraction import airy_tail, band_wavelengths, defocus_otf
from simgl.camera.kernel_fit import fitted
from simgl.camera.lens import Blur
from simgl.errors import ConfigError
from simgl.physics.constants import SOLAR_TEMPERATURE

# Smallest and largest half width of a core [px].
SMALLEST_REACH, LARGEST_REACH = 64, 512
# Nodes of the table of an optical transfer function.
_TABLE = 8192
# Of a polynomial along half a cycle per pixel of a transfer function, for 1e-9.
_SMOOTH_NODES = 16


@dataclass(frozen=True, eq=False)
class PsfKernel:
    """Point spread of one band; core and tail sum to 1.

    core : (2 reach + 1, 2 reach + 1), fades to 0 towards its edge
    tail : fraction of the light in a pixel at the distance r [px], times r^3; 0 for none
    """

    core: Array
    tail: float

    @property
    def reach(self) -> int:
        """Half width of the core [px]."""
        return int(self.core.shape[0]) // 2


def core_share(distance: Array, reach: int) -> Array:
    """Weight of the core at a distance: 1 up to half the reach, 0 from the reach on [px]."""
    t = np.clip(2.0 * distance / reach - 1.0, 0.0, 1.0)
    return 0.5 + 0.5 * np.cos(np.pi * t)


def lens_transfer(camera: Camera, blur: Blur, band: int, frequency: Array) -> Array:
    """Optical transfer function of a lens in one band.

    frequency : [cycles per pixel]

    Diffraction with defocus, averaged over the electrons of sunlight in the band, times a Gaussian.
    """
    lens, pitch = camera.lens, camera.detector.pixel_pitch
    transfer = np.exp(-2.0 * (np.pi * blur.aberration / pitch * frequency) ** 2)
    if lens.spread is not None and lens.spread.diffraction:
        wavelengths, shares = _wavelengths(camera)
        wave = np.zeros_like(transfer)
        for wavelength, share in zip(wavelengths[band], shares[band], strict=True):
            # Path difference at the edge of the pupil: dz / (8 N^2).
            waves = blur.defocus / (8.0 * lens.f_number**2 * wavelength)
            cut_off = pitch / (wavelength * lens.f_number)
            wave += share * defocus_otf(frequency / cut_off, waves)
        transfer = transfer * wave
    return transfer


def lens_reach(camera: Camera, blur: Blur) -> int:
    """Half width of the core that a blur needs [px].

    Raises ConfigError for a blur over more pixels than can be convolved.
    """
    lens, pitch = camera.lens, camera.detector.pixel_pitch
    assert lens.spread is not None
    radius = (4.0 * blur.aberration + 0.5 * abs(blur.defocus) / lens.f_number) / pitch
    if lens.spread.diffraction:
        # The tail's formula holds from about the twentieth dark ring on.
        radius += 20.0 * mean_wavelength(camera, 1) * lens.f_number / pitch
    reach = SMALLEST_REACH
    while reach < 2.0 * radius:
        reach *= 2
    if reach > LARGEST_REACH:
        problem = (
            f"spreads a point over {2 * radius:.0f} pixels, at most {LARGEST_REACH} are possible"
        )
        raise ConfigError(f"[camera.{camera.name}]", "optics", problem)
    return int(reach)


def lens_kernel(camera: Camera, blur: Blur, band: int, reach: int, ramp: float = 0.0) -> PsfKernel:
    """The kernel of a lens in one band at one blur, with the given half width [px].

    ramp : by which the pixels that it spreads are softened [px]
    """
    lens, pitch = camera.lens, camera.detector.pixel_pitch
    assert lens.spread is not None
    tail = 0.0
    if lens.spread.diffraction:
        tail = airy_tail(mean_wavelength(camera, band), lens.f_number, pitch)
    if not lens.spread.diffraction and blur == Blur():
        point = np.zeros((2 * reach + 1, 2 * reach + 1))
        point[reach, reach] = 1.0
        return PsfKernel(point, 0.0)
    samples = _mixed(camera, blur, band, 4 * reach)
    offset = np.arange(-reach, reach + 1)
    distance = np.hypot(offset[:, None], offset)
    core = np.maximum(samples[np.ix_(offset, offset)], 0.0) * core_share(distance, reach)
    if tail == 0.0:
        # Far from a Gaussian only the rounding of the table is left.
        core[core < 1e-9 * core.max()] = 0.0
    # Exactly even, so that its spectrum is real.
    core = core + core[::-1, ::-1]
    core *= (1.0 - tail_energy(tail, reach)) / core.sum()
    if ramp > 0.0:
        core = fitted(core, lambda f: lens_transfer(camera, blur, band, f), ramp)
    return PsfKernel(core, tail)


def _wavelengths(camera: Camera) -> tuple[Array, Array]:
    return band_wavelengths(SOLAR_TEMPERATURE, camera.detector.bands, camera.detector.pixel_curves)


def mean_wavelength(camera: Camera, band: int) -> float:
    """Of the light that makes electrons in a band [m]."""
    wavelengths, shares = _wavelengths(camera)
    return float(np.sum(wavelengths[band] * shares[band]))


def tail_energy(tail: float, reach: int) -> float:
    """Integral of a kernel's tail over the plane."""
    # 2 pi integral of tail r^-2 (1 - core_share) dr, whose part beyond the reach is 2 pi tail / r.
    edge = np.linspace(0.5 * reach, reach, 513)
    middle = 0.5 * (edge[1:] + edge[:-1])
    near = np.sum(np.diff(edge) * (1.0 - core_share(middle, reach)) / middle**2)
    return float(2.0 * np.pi * tail * (near + 1.0 / reach))


def _aliased(
    transfer: Callable[[Array, Array], Array],
    cut_offs: tuple[float, float],
    line: Array,
    nodes: int,
) -> Array:
    """(3, n, n) spectra of samples of a transfer function, and of its means over a pixel and twice.

    transfer : 0 beyond the last of the cut-offs
    cut_offs : first and last, between which it is not smooth [cycles per pixel]
    line : (n,) frequencies from 0 to 1/2
    nodes : with which a polynomial follows it along the line where it is smooth
    """

    def terms(v: Array, u: Array) -> list[Array]:
        both = transfer(v[..., :, None], u[..., None, :])
        pixel = np.sinc(v)[..., :, None] * np.sinc(u)[..., None, :]
        return [both, both * pixel, both * pixel**2]

    total = np.zeros((3, len(line), len(line)))
    smooth = np.zeros((3, nodes, nodes))
    across_line = chebyshev_interpolation(nodes, 2.0 * line)
    at = 0.5 * chebyshev_nodes(nodes)
    first, last = cut_offs
    alias = np.arange(-int(np.ceil(last)), int(np.ceil(last)) + 1)
    nearest = np.maximum(np.maximum(alias, -alias - 0.5), 0.0)
    farthest = np.maximum(np.abs(alias), np.abs(alias + 0.5))
    for index, down in enumerate(alias.tolist()):
        within = np.hypot(nearest[index], nearest) < last
        plain = within & (np.hypot(farthest[index], farthest) < first) & (nodes < len(line))
        plain &= (alias != 0) | (down != 0)
        for across in alias[within & ~plain].tolist():
            for sum_, term in zip(total, terms(line + down, line + across), strict=True):
                sum_ += term
        v = np.broadcast_to(at + down, (int(plain.sum()), nodes))
        for sum_, term in zip(smooth, terms(v, at + alias[plain, None]), strict=True):
            sum_ += term.sum(axis=0)
    return total + across_line @ smooth @ across_line.T


def _mixed(camera: Camera, blur: Blur, band: int, size: int) -> Array:
    """(size, size) periodic kernel with its centre at [0, 0]."""
    lens, pitch = camera.lens, camera.detector.pixel_pitch
    first = last = np.inf
    if lens.spread is not None and lens.spread.diffraction:
        wavelengths, _ = _wavelengths(camera)
        first, last = (
            pitch / (float(end(wavelengths[band])) * lens.f_number) for end in (np.max, np.min)
        )
    if blur.aberration > 0.0:
        # exp(-2 (pi s f)^2) is below 1e-9 from here on.
        last = min(last, 1.03 * pitch / blur.aberration)
    frequency = np.linspace(0.0, last, _TABLE)
    table = lens_transfer(camera, blur, band, frequency)
    line = np.asarray(np.fft.rfftfreq(size), dtype=np.float64)

    def transfer(v: Array, u: Array) -> Array:
        return np.interp(np.hypot(v, u), frequency, table, right=0.0)

    # A disc of light beats so many times along the line.
    beats = abs(blur.defocus) / lens.f_number / pitch
    spectra = _aliased(transfer, (first, last), line, _SMOOTH_NODES + int(2.0 * beats))
    # Normalised to 1 by the sample in the centre, the only one that differs from the mean.
    spectra += 1.0 - spectra[:, :1, :1]
    wanted = transfer(line[:, None], line)
    # Fitted along an axis and along the diagonal.
    axis, diagonal = (np.arange(len(line)), np.zeros(len(line), int)), (np.arange(len(line)),) * 2
    weights, _ = scipy.optimize.nnls(
        np.concatenate([spectra[:, *axis], spectra[:, *diagonal]], axis=1).T,
        np.concatenate([wanted[axis], wanted[diagonal]]),
    )
    weights /= weights.sum()
    quarter = np.tensordot(weights, spectra, 1)
    # The spectrum is even in the row frequency.
    half = np.concatenate([quarter, quarter[-2:0:-1]])
    return scipy.fft.irfft2(half, s=(size, size))


def image_kernel(image: Array, scale: int) -> PsfKernel:
    """The kernel of a measured point spread.

    image : (rows, columns), non-negative, centred on the point
    scale : samples per pixel along an edge
    """
    reach = SMALLEST_REACH
    while 2 * reach * scale < max(image.shape):
        reach *= 2
    down, across = (_binning(n, scale, reach) for n in image.shape)
    core = down @ image @ across.T
    return PsfKernel(core / core.sum(), 0.0)


def _binning(samples: int, scale: int, reach: int) -> Array:
    """(2 reach + 1, samples) fraction of each sample that lies in each pixel."""
    left = (np.arange(samples) - 0.5 * samples) / scale
    low = np.arange(-reach, reach + 1)[:, None] - 0.5
    overlap = np.minimum(low + 1.0, left + 1.0 / scale) - np.maximum(low, left)
    return np.maximum(overlap, 0.0) * scale
