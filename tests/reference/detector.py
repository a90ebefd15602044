"""A detector in numpy, float64, step by step in the order of its physics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from simgl.arrays import Array, Image16, UIntArray
from simgl.camera.blooming import with_blooming
from simgl.camera.camera import Camera
from simgl.camera.camera_equation import square_electrons_per_irradiance
from simgl.camera.detector import Detector
from simgl.camera.noise_streams import (
    PIXELS,
    Stream,
    epoch_words,
    frame_key,
    list_words,
    normal,
    philox,
    row_offsets,
    uniform_01,
)
from simgl.camera.particle_hits import hits


def pattern_key(serial: int, stream: Stream) -> UIntArray:
    """(2,) key of something that stays with a camera for life."""
    return np.array([serial, stream], dtype=np.uint32)


def pixel_words(
    width: int, height: int, key: UIntArray, epoch: tuple[int, int] = (0, 0), draw: int = 0
) -> UIntArray:
    """(height, width) words, one a pixel."""
    groups = -(-width // PIXELS)
    y, x = np.divmod(np.arange(groups * height, dtype=np.uint32), np.uint32(groups))
    counter = np.zeros((groups * height, 4), dtype=np.uint32)
    counter[:, 0] = x + (y << np.uint32(16))
    counter[:, 1] = draw
    counter[:, 2:] = epoch
    return philox(counter, key).reshape(height, groups * PIXELS)[:, :width]


# Below so many electrons on average, counts come from Poisson's distribution itself.
FEW = 20.0


def mean_electrons(camera: Camera, irradiance: Array, photons_per_joule: Array) -> Array:
    """(height, width) mean photo-electrons: E A t (photons per joule) QE, summed over the bands.

    irradiance : (height, width, 4) of the image plane [W m-2 per band]
    photons_per_joule : (4,) of the light's spectrum in each band
    """
    square = square_electrons_per_irradiance(camera, photons_per_joule).reshape(2, 2, 4)
    height, width = irradiance.shape[:2]
    y, x = np.indices((height, width))
    return np.sum(irradiance * square[y % 2, x % 2], axis=-1)


@dataclass(frozen=True, kw_only=True, eq=False)
class Pattern:
    """What stays with a camera, (height, width) each.

    gain : response, 1 on average
    dark_current : beyond that of every pixel [e- s-1]
    offset : [e-]
    """

    gain: Array
    dark_current: Array
    offset: Array


def fixed_pattern(detector: Detector) -> Pattern:
    """Drawn from the detector's serial number."""
    width, height, p = detector.width, detector.height, detector.pattern

    def random(stream: Stream) -> Array:
        return uniform_01(pixel_words(width, height, pattern_key(detector.serial, stream)))

    def along(count: int, stream: Stream) -> UIntArray:
        return list_words(count, pattern_key(detector.serial, stream))

    gain = np.maximum(1.0 + p.prnu * normal(random(Stream.PRNU)), 0.0)
    gain[random(Stream.DEAD) < p.dead_pixels] = 0.0
    dark = np.zeros((height, width))
    if p.hot_pixels > 0.0:
        u = random(Stream.HOT) / p.hot_pixels
        dark[u < 1.0] = -detector.hot_current * np.log(u[u < 1.0])
    rows = normal(uniform_01(along(height, Stream.ROWS)[:, 0]))
    columns = normal(uniform_01(along(-(-width // 4), Stream.COLUMNS).ravel()[:width]))
    offset = p.dsnu * normal(random(Stream.DSNU)) + p.rows * rows[:, None] + p.columns * columns
    return Pattern(gain=gain, dark_current=dark, offset=offset)


def poisson(mean: Array, u: Array) -> Array:
    """Counts of Poisson's distribution by inversion at u in (0, 1).

    From ``FEW`` on by the expansion of Cornish and Fisher, m + s z + (z^2 - 1) / 6 +
    (z - z^3) / (72 s), rounded; with s^2 = m - 1/12, as rounding adds 1/12 to the variance.
    """
    z = normal(u)
    s = np.sqrt(np.maximum(mean, FEW) - 1.0 / 12.0)
    many = np.floor(mean + s * z + (z * z - 1.0) / 6.0 + (z - z**3) / (72.0 * s) + 0.5)
    few = stats.poisson.ppf(u, np.minimum(mean, FEW))
    return np.where(mean < FEW, few, many)


def digital(camera: Camera, light: Array, tai_ns: int, seed: int, draw: int = 0) -> Image16:
    """(height, width) DN of a picture.

    light : (height, width) mean photo-electrons
    """
    d, t = camera.detector, camera.exposure_time
    pattern = fixed_pattern(d)

    def random(stream: Stream) -> Array:
        key = frame_key(seed, camera.name, stream)
        return uniform_01(pixel_words(d.width, d.height, key, epoch_words(tai_ns), draw))

    mean = light * pattern.gain + t * (d.dark_current + pattern.dark_current)
    electrons = poisson(np.clip(mean, 0.0, max(1e7, 2.0 * d.full_well)), random(Stream.SHOT))
    pixels, deposits = hits(camera, tai_ns, seed, draw)
    electrons.ravel()[pixels] += deposits
    if d.blooming > 0.0:
        electrons = with_blooming(electrons.astype(np.float32), d.full_well, d.blooming).astype(
            np.float64
        )
    signal = np.minimum(electrons, d.full_well) + pattern.offset
    if d.row_noise > 0.0:
        signal = signal + row_offsets(camera, tai_ns, seed, draw)[:, None]
    signal = signal + d.read_noise * normal(random(Stream.READ))
    dn = np.clip(np.floor(signal * d.gain_dn_per_e + d.pedestal), 0.0, d.largest_dn)
    return dn.astype(np.uint16)
