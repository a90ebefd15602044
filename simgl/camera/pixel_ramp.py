"""How much the pixels that see the scene are softened for a lens."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from simgl.arrays import Array
from simgl.camera.camera import Camera
from simgl.camera.kernel_fit import contrast_error, fitted
from simgl.camera.psf_kernel import lens_kernel, lens_reach, lens_transfer
from simgl.lru_cache import MANY, LruCache

# Width of the ramps between pixels in each band [px].
Ramps = tuple[float, float, float, float]
SHARP: Ramps = (0.0, 0.0, 0.0, 0.0)

# Widths that are tried [px]; with the widest, a pixel sees no farther than its neighbours.
_WIDTHS = np.arange(0.0, 2.01, 0.125)
# Of the contrast, rms: where kernels without ramps leave no more, there are none.
_EXACT = 1e-3

# Frequencies of a table of the transfer function, beyond the diagonal of those of the fit.
_TABLE = np.linspace(0.0, 0.8, 2049)

_ramps = LruCache[object, Ramps](MANY)


def pixel_ramps(camera: Camera) -> Ramps:
    """Width of the ramps between pixels, with which kernels come closest to the lens [px].

    ``SHARP`` for a lens without point spread, for a measured one, and where all its light is spread
    so widely that kernels need no ramps.
    """
    spread = camera.lens.spread
    if spread is None or spread.image is not None:
        return SHARP
    if not spread.diffraction and all(zone.blur.aberration == 0.0 for zone in spread.zones):
        return SHARP
    d = camera.detector
    key = camera.lens, d.pixel_pitch, d.bands, d.pixel_curves
    return _ramps.get(key, lambda: _closest(camera))


def _closest(camera: Camera) -> Ramps:
    spread = camera.lens.spread
    assert spread is not None
    # Without diffraction all bands are spread alike.
    errors = [_errors(camera, band) for band in range(4 if spread.diffraction else 1)]
    if all(of_band[0] < _EXACT for of_band in errors):
        return SHARP
    if len(errors) == 1:
        width = float(_WIDTHS[1 + np.argmin(errors[0][1:])])
        return width, width, width, width
    # Diffraction needs wider ramps at longer wavelengths, defocus at shorter ones. In order of
    # either: where any width is right, kernels that are mixed from those of two bands need ramps
    # alike.
    bands = np.argsort(camera.detector.bands.channel_edges.mean(axis=1)).tolist()
    _, widths = min(
        (_not_narrower(errors, order) for order in (bands, bands[::-1])), key=lambda one: one[0]
    )
    red, green, blue, infrared = widths
    return red, green, blue, infrared


def _not_narrower(errors: list[Array], order: list[int]) -> tuple[float, list[float]]:
    """Widths that do not decrease in an order of the bands, and the sum of their squared errors."""
    widths, total, narrowest = [0.0] * 4, 0.0, 1
    for band in order:
        narrowest += int(np.argmin(errors[band][narrowest:]))
        widths[band] = float(_WIDTHS[narrowest])
        total += float(errors[band][narrowest]) ** 2
    return total, widths


def _tabled(values: Array) -> Callable[[Array], Array]:
    return lambda frequency: np.interp(frequency, _TABLE, values)


def _errors(camera: Camera, band: int) -> Array:
    """Error of the contrast with a ramp of each width, rms over the zones."""
    spread = camera.lens.spread
    assert spread is not None
    squares = np.zeros((len(spread.zones), len(_WIDTHS)))
    for row, zone in zip(squares, spread.zones, strict=True):
        core = lens_kernel(camera, zone.blur, band, lens_reach(camera, zone.blur)).core
        # Linear in between, to 1e-6: every width asks for it anew, and defocus takes long.
        transfer = _tabled(lens_transfer(camera, zone.blur, band, _TABLE))
        for index, ramp in enumerate(_WIDTHS.tolist()):
            row[index] = contrast_error(fitted(core, transfer, ramp), transfer, ramp) ** 2
    return np.asarray(np.sqrt(squares.mean(axis=0)))
