"""Sample grids for supersampling: how many points a pixel averages, and where they lie.

Spacecraft are rasterised on a finer square grid that is turned against the pixel grid by an angle
whose tangent is far from any simple fraction. An edge along the rows or columns of the image then
crosses the samples of different pixels at different places: its position comes out right to a small
part of a pixel even with few samples, where a grid along the pixels would make every row step at
once. A pixel's value is the mean of the samples inside it, n on average.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array

# The continued fraction of sqrt(5) - 2, [0; 4, 4, 4, ...], has no large terms, so the columns of
# the samples spread evenly at every scale.
ANGLE = float(np.arctan(np.sqrt(5.0) - 2.0))

# A unit square holds at least one sample if the grid's covering radius, 1 / sqrt(2 n), is below
# one half: n > 2. Fewer than five leave edges coarse.
MIN_SAMPLES, MAX_SAMPLES = 5, 4096
# On the outline of a spacecraft lit from behind the camera: its flux then comes out right to some
# parts in a thousand, however few pixels it covers.
MIN_TARGET_SAMPLES = 16384
# Less of a spacecraft than this is lit on average at a phase angle of 151 deg.
_MIN_LIT = 1.0 / 16.0
# Per pixel, for a sphere of 1 px whose limb is as bright as all of its light over its outline: they
# place the centre of a crescent to 0.01 px (``target_samples``). Beyond 160 deg nothing is added.
_LIMB_SAMPLES, _THINNEST_CRESCENT = 38.0, float(np.cos(np.radians(160.0)))
# Of the budget, for spacecraft that need more than it gives them; and up to so many times that they
# may need, for half of what they need leaves their centre within 0.02 px. More would be in vain.
_MAX_BUDGETS, USEFUL_NEED = 4, 2.0


@dataclass(frozen=True)
class SampleGrid:
    """A square grid of ``scale`` samples per pixel edge, turned by ``angle`` [rad]."""

    scale: float
    angle: float

    @property
    def turn(self) -> Array:
        """(2, 2) matrix from pixel to raster directions."""
        c, s = self.scale * np.cos(self.angle), self.scale * np.sin(self.angle)
        return np.array([[c, s], [-s, c]])

    def raster_size(self, width: int, height: int) -> tuple[int, int]:
        """Texels that hold every sample of a rectangle of width x height pixels."""
        extent = np.abs(self.turn) @ np.array([width, height])
        columns, rows = np.ceil(extent - 1e-9).astype(int)
        return int(columns), int(rows)

    def raster_from_pixel(self, width: int) -> Array:
        """(2, 3) affine map from pixel coordinates (x, y, 1) in the rectangle to the raster."""
        return np.column_stack([self.turn, [0.0, -self.turn[1, 0] * width]])

    @property
    def cells_per_edge(self) -> int:
        """Cells along the edge of a pixel: so many that each holds about ``MIN_SAMPLES``."""
        return max(1, round(self.scale / float(np.sqrt(MIN_SAMPLES))))


# One sample at the very centre of each pixel.
PIXEL_CENTRES = SampleGrid(1.0, 0.0)


def rotated_sample_grid(samples_per_pixel: float) -> SampleGrid:
    """The grid of so many samples per pixel on average."""
    return SampleGrid(float(np.sqrt(samples_per_pixel)), ANGLE)


def target_samples(cos_phase_angle: float, width_px: float) -> float:
    """Samples that a spacecraft's outline needs, by the cosine of its phase angle and its width.

    The error of a mean over a lattice falls with the power 3/4 of the samples that are lit, and of
    its centre likewise. A sphere shows (1 + cos) / 2 of its outline lit.

    Of a crescent the limb decides: n samples per pixel leave its light uncertain by its brightness
    times the square root of its length over n^(3/4). That moves the centre by the share of all the
    light times the width, so that n goes with (brightness / light)^(4/3) width^(-2/3).
    """
    lit = max(0.5 * (1.0 + cos_phase_angle), _MIN_LIT)
    cosine = max(cos_phase_angle, _THINNEST_CRESCENT)
    phase, limb = float(np.arccos(min(cosine, 1.0))), float(np.sqrt(max(1.0 - cosine**2, 0.0)))
    # Of a Lambertian sphere, over its brightness at full phase.
    light = (limb + (np.pi - phase) * cosine) / np.pi
    of_limb = _LIMB_SAMPLES * (limb / light) ** (4.0 / 3.0) * 0.25 * np.pi * width_px ** (4.0 / 3.0)
    return max(MIN_TARGET_SAMPLES / float(lit**0.75), of_limb)


def choose_sample_grid(
    pixels: int,
    sample_budget: int,
    samples_per_pixel: int | None = None,
    needed: float = 0.0,
) -> SampleGrid:
    """The finest grid that puts about ``sample_budget`` samples on so many pixels.

    samples_per_pixel : wanted instead, where it is enough for the spacecraft on these pixels
    needed : samples per pixel that these need; up to ``_MAX_BUDGETS`` times the budget where that
        is about enough
    """
    finest, max_finest = (
        min(max(budget // pixels, MIN_SAMPLES), MAX_SAMPLES)
        for budget in (sample_budget, _MAX_BUDGETS * sample_budget)
    )
    wanted = finest if samples_per_pixel is None else samples_per_pixel
    possible = max_finest if needed <= USEFUL_NEED * max_finest else finest
    return rotated_sample_grid(max(wanted, min(needed, possible)))
