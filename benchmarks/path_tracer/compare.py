"""How two pictures of one scene differ."""

from __future__ import annotations

from dataclasses import dataclass

import msgspec
import numpy as np

from simgl.arrays import Array

# A pixel's difference is taken relative to the reference, but at least to this share of its mean.
FLOOR = 0.01
WITHIN = 0.10


class Agreement(msgspec.Struct, frozen=True, kw_only=True):
    """How simgl's picture agrees with the reference, over pixels that hold a spacecraft.

    mean_ratio : of simgl's sum to the reference's, all bands and each one
    within_10_percent : share of the pixels, edges included; of those that are brighter than a
        tenth of the mean; and weighted by their radiance
    noise : median and 95th percentile of the reference's own standard error, relative alike
    misalignment_px : along columns and rows, that explains the difference best
    """

    pixels: int
    mean_ratio: float
    mean_ratio_bands: list[float]
    within_10_percent: float
    within_10_percent_bright: float
    within_10_percent_by_light: float
    median_difference: float
    noise_median: float
    noise_p95: float
    misalignment_px: list[float]


@dataclass(frozen=True, kw_only=True, eq=False)
class Difference:
    """relative : (height, width) signed, of simgl to the reference, bands together; 0 in space."""

    agreement: Agreement
    relative: Array


def difference(simgl: Array, reference: Array, error: Array) -> Difference:
    """Two pictures (height, width, bands) and the reference's standard error compared.

    The bands of a path are one path, so their errors add.
    """
    a, b = simgl.sum(axis=2), reference.sum(axis=2)
    seen = (a > 0.0) | (b > 0.0)
    mean = float(b[seen].mean())
    scale = np.maximum(b, FLOOR * mean)
    relative = np.where(seen, (a - b) / scale, 0.0)
    noise = (error.sum(axis=2) / scale)[seen]
    near = np.abs(relative[seen]) <= WITHIN
    bands = simgl.sum(axis=(0, 1)) / reference.sum(axis=(0, 1))
    agreement = Agreement(
        pixels=int(seen.sum()),
        mean_ratio=float(a.sum() / b.sum()),
        mean_ratio_bands=[float(v) for v in bands],
        within_10_percent=float(near.mean()),
        within_10_percent_bright=float(near[b[seen] > 0.1 * mean].mean()),
        within_10_percent_by_light=float(np.average(near, weights=b[seen])),
        median_difference=float(np.median(relative[seen])),
        noise_median=float(np.median(noise)),
        noise_p95=float(np.percentile(noise, 95.0)),
        misalignment_px=_misalignment(a, b),
    )
    return Difference(agreement=agreement, relative=relative)


def _misalignment(a: Array, b: Array) -> list[float]:
    """Least squares of a - b against the picture's slopes: a(x + d) = b(x)."""
    down, right = np.gradient(0.5 * (a + b))
    slopes = np.stack([right.ravel(), down.ravel()], axis=1)
    solution = np.linalg.lstsq(slopes, (b - a).ravel(), rcond=None)[0]
    return [float(v) for v in solution]
