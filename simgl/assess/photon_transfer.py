"""Photon transfer: camera parameters from flat fields and dark frames (EMVA 1288, release 4).

Frames are DN, of one colour, from any source.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array, Image16, Mask

# Variance that quantisation adds [DN^2], and the smallest variance at which that value holds.
QUANTISATION = 1.0 / 12.0
_MIN_VARIANCE = 0.24

# Signal range of the fits, as shares of the saturation.
_FIT_END = 0.7
_LINEAR_PART = (0.05, 0.95)


@dataclass(frozen=True, kw_only=True, eq=False)
class TransferCurve:
    """Pairs of flat fields at rising light, the first of them dark.

    photons : (n,) mean on a pixel during the exposure
    mean : (n,) [DN]
    variance : (n,) in time [DN^2]
    """

    photons: Array
    mean: Array
    variance: Array

    @property
    def signal(self) -> Array:
        """(n,) mean above dark [DN]."""
        return self.mean - self.mean[0]

    @property
    def saturation(self) -> int:
        """Index of the saturation: the largest variance."""
        return int(np.argmax(self.variance))

    @property
    def _fitted(self) -> Mask:
        return self.signal <= _FIT_END * self.signal[self.saturation]

    @property
    def gain(self) -> float:
        """System gain K [DN / e-], slope of the variance over the signal."""
        x, y = self.signal[self._fitted], (self.variance - self.variance[0])[self._fitted]
        return float(x @ y / (x @ x))

    @property
    def responsivity(self) -> float:
        """R [DN per photon], slope of the signal over the photons."""
        x, y = self.photons[self._fitted], self.signal[self._fitted]
        return float(x @ y / (x @ x))

    @property
    def quantum_efficiency(self) -> float:
        """Electrons per photon on the whole pixel, R / K."""
        return self.responsivity / self.gain

    @property
    def dark_noise(self) -> float:
        """Temporal noise in the dark [e- rms], without that of quantisation."""
        variance = self.variance[0]
        noise = variance - QUANTISATION if variance >= _MIN_VARIANCE else 0.0
        return float(np.sqrt(max(noise, 0.0)) / self.gain)

    @property
    def saturation_capacity(self) -> float:
        """Signal at the largest variance [e-]; above it the full well clips the noise."""
        return float(self.signal[self.saturation] / self.gain)

    @property
    def threshold(self) -> float:
        """Photons at which signal over noise is 1."""
        noise = float(np.sqrt(max(self.variance[0], _MIN_VARIANCE))) / self.gain
        return (noise + 0.5) / self.quantum_efficiency

    @property
    def dynamic_range(self) -> float:
        """Saturation over threshold."""
        return float(self.photons[self.saturation] / self.threshold)

    @property
    def snr_max(self) -> float:
        """Signal over temporal noise at saturation, limited by shot noise."""
        return float(np.sqrt(self.saturation_capacity))

    def line(self) -> tuple[float, float]:
        """Offset [DN] and slope [DN per photon], of relative errors, 5 to 95 % of saturation."""
        x, y = self.photons[self.linear_part], self.signal[self.linear_part]
        matrix = np.stack([np.ones_like(x), x], axis=1) / y[:, None]
        (offset, slope), *_ = np.linalg.lstsq(matrix, np.ones_like(y), rcond=None)
        return float(offset), float(slope)

    @property
    def linear_part(self) -> Mask:
        """(n,) the points within 5 to 95 % of saturation."""
        low, high = (share * self.signal[self.saturation] for share in _LINEAR_PART)
        return (self.signal >= low) & (self.signal <= high)

    @property
    def deviations(self) -> Array:
        """Signal over the line, minus one, of the points in the linear part."""
        offset, slope = self.line()
        fit = offset + slope * self.photons[self.linear_part]
        return self.signal[self.linear_part] / fit - 1.0

    @property
    def linearity_error(self) -> float:
        """Mean absolute deviation."""
        return float(np.abs(self.deviations).mean())


def pair_statistics(a: Image16, b: Image16) -> tuple[float, float]:
    """Mean and variance in time of two frames of the same light [DN, DN^2].

    Fixed patterns cancel in the difference.
    """
    difference = a.astype(np.float64) - b
    return float(0.5 * (a.mean() + b.mean())), float(0.5 * difference.var())


@dataclass(frozen=True, kw_only=True, eq=False)
class SpatialStatistics:
    """Fixed pattern: the average of many frames of the same light.

    mean : (height, width) [DN]
    variance : of the pixels, less the remaining temporal noise [DN^2]
    standard_error : of that variance, by what remains of temporal noise [DN^2]
    rows, columns, pixels : that variance in parts [DN^2]
    """

    mean: Array
    variance: float
    standard_error: float
    rows: float
    columns: float
    pixels: float


def spatial_statistics(frames: Iterable[Image16]) -> SpatialStatistics:
    """Variances in space; at least two frames."""
    count, total, squares = 0, np.zeros(()), np.zeros(())
    for frame in frames:
        values = frame.astype(np.float64)
        count, total, squares = count + 1, total + values, squares + values * values
    mean = total / count
    temporal = float((squares / count - mean * mean).mean() * count / (count - 1))
    height, width = mean.shape
    total_variance = float(mean.var())
    # The mean of a row is the row's offset plus the mean of its pixels; likewise for columns.
    of_rows, of_columns = float(mean.mean(axis=1).var()), float(mean.mean(axis=0).var())
    residual = total_variance - of_rows - of_columns
    pixels = residual / ((1.0 - 1.0 / width) * (1.0 - 1.0 / height))
    rows, columns = of_rows - pixels / width, of_columns - pixels / height
    return SpatialStatistics(
        mean=mean,
        variance=max(total_variance - temporal / count, 0.0),
        # Of the variance of a Gaussian in N pixels: sqrt(2 / N) of it.
        standard_error=temporal / count * float(np.sqrt(2.0 / mean.size)),
        rows=max(rows, 0.0),
        columns=max(columns, 0.0),
        pixels=max(pixels - temporal / count, 0.0),
    )


def slope(x: Sequence[float], y: Sequence[float]) -> float:
    """Of the straight line through points."""
    return float(np.polyfit(x, y, 1)[0])
