"""How much the pixels that see the scene are softened for a lens."""

from __future__ import annotations

from functools import partial

import numpy as np

from simgl.camera.camera import Camera
from simgl.camera.kernel_fit import fitted
from simgl.camera.psf_kernel import lens_kernel, lens_reach, lens_transfer
from simgl.lru_cache import MANY, LruCache
from simgl.physics.constants import SOLAR_CONSTANT, SOLAR_TEMPERATURE
from simgl.physics.spectrum import black_body_light

# Widths that are tried [px]; with the widest, a pixel sees no farther than its neighbours.
_RAMPS = np.arange(0.0, 1.51, 0.125)
# Of the contrast, rms: where kernels without a ramp leave no more, there is none.
_EXACT = 1e-3

_ramps = LruCache[object, float](MANY)


def pixel_ramp(camera: Camera) -> float:
    """Width of the ramps between pixels, with which kernels come closest to the lens [px].

    0 for a lens without point spread, for a measured one, and where all its light is spread so
    widely that kernels need no ramp.
    """
    spread = camera.lens.spread
    if spread is None or spread.image is not None:
        return 0.0
    if not spread.diffraction and all(zone.blur.aberration == 0.0 for zone in spread.zones):
        return 0.0
    key = (camera.lens, camera.detector.pixel_pitch, camera.detector.bands)
    return _ramps.get(key, lambda: _closest(camera))


def _closest(camera: Camera) -> float:
    spread = camera.lens.spread
    assert spread is not None
    # The visible bands by their sunlight, or one for all: near infrared, which diffraction spreads
    # most, would do with any. Of other bands the first three.
    seen = camera.detector.bands
    light = black_body_light(SOLAR_CONSTANT, SOLAR_TEMPERATURE, seen).irradiance
    bands = range(min(len(seen.edges), 3)) if spread.diffraction else range(1)
    misses = np.zeros(len(_RAMPS))
    for zone in spread.zones:
        reach = lens_reach(camera, zone.blur)
        for band in bands:
            core = lens_kernel(camera, zone.blur, band, reach).core
            transfer = partial(lens_transfer, camera, zone.blur, band)
            for index, ramp in enumerate(_RAMPS.tolist()):
                _, miss = fitted(core, transfer, ramp)
                misses[index] += light[band] * miss**2
    misses = np.sqrt(misses / (len(spread.zones) * light[list(bands)].sum()))
    return 0.0 if misses[0] < _EXACT else float(_RAMPS[np.argmin(misses)])
