"""How far around an image a lens brings light into it: scenes are drawn with that margin."""

from __future__ import annotations

import numpy as np

from simgl.camera.camera import Camera
from simgl.camera.camera_schema import MAX_EDGE
from simgl.camera.diffraction import airy_tail
from simgl.camera.lens import Blur, PointSpread
from simgl.camera.pinhole_fields import pinhole_fields
from simgl.camera.psf_kernel import mean_wavelength
from simgl.errors import ConfigError
from simgl.lru_cache import MANY, LruCache

# Of the light of a pixel at the edge of an even image, what may be missing.
_MISSING = 0.005
# Pixels by which margins grow, whole squares of colour filters; and at most.
_STEP, _WIDEST = 4, 64
# Gaussian deviations that hold all but 0.3 % of the light.
_DEVIATIONS = 3.0
# Of the ramps between pixels, and of half a pixel.
_OF_PIXELS = 2.0

_margins = LruCache[object, int](MANY)


def image_margin(camera: Camera) -> int:
    """Pixels around the image that its scene is drawn on, for what a lens brings from there.

    0 for a lens without point spread, and for one that distorts and does not see so far.
    """
    if camera.lens.spread is None:
        return 0
    d = camera.detector
    key = camera.lens, camera.geometry, d.pixel_pitch, d.bands, d.pixel_curves
    return _margins.get(key, lambda: _margin(camera))


def _margin(camera: Camera) -> int:
    spread, d = camera.lens.spread, camera.detector
    assert spread is not None
    reach = _of_image(spread) if spread.image is not None else _of_lens(camera, spread)
    largest = min(_WIDEST, (MAX_EDGE - max(d.width, d.height)) // 2)
    margin = max(min(_STEP * int(np.ceil(reach / _STEP)), _STEP * (largest // _STEP)), 0)
    if not camera.is_pinhole:
        try:
            pinhole_fields(camera.with_margin(margin))
        except ConfigError:
            return 0
    return margin


def _of_image(spread: PointSpread) -> float:
    """Of a measured point spread [px]."""
    light = np.array(spread.image)
    reach = 0.0
    for axis in (0, 1):
        line = light.sum(axis=axis) / light.sum()
        off = np.abs(np.arange(len(line)) + 0.5 - 0.5 * len(line))
        beyond = [line[off > distance].sum() > 2.0 * _MISSING for distance in off]
        reach = max(reach, float(off[beyond].max(initial=0.0)) / spread.image_scale)
    return reach + _OF_PIXELS


def _of_lens(camera: Camera, spread: PointSpread) -> float:
    """Of diffraction and blur [px]."""
    lens, pitch = camera.lens, camera.detector.pixel_pitch
    if not spread.diffraction and all(zone.blur == Blur() for zone in spread.zones):
        return 0.0
    reach = _OF_PIXELS + max(
        (_DEVIATIONS * zone.blur.aberration + 0.5 * abs(zone.blur.defocus) / lens.f_number) / pitch
        for zone in spread.zones
    )
    if spread.diffraction:
        # Of a tail a / r^3 the part 2 a / x lies more than x to one side.
        longest = max(mean_wavelength(camera, band) for band in range(4))
        reach += 2.0 * airy_tail(longest, lens.f_number, pitch) / _MISSING
    return reach
