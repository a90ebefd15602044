"""Sampling lattices: how many points of the scene a pixel averages, and where they lie.

Spacecraft are rasterised on a square grid that is turned against the pixel grid, so that the n
samples of a pixel have n different columns and n different rows: an edge along the rows or columns of
the image then falls on n steps, not on sqrt(n). With coprime integers a > b >= 0 of odd a + b and
n = a^2 + b^2, raster coordinates are u = a x + b y, v = b (w - x) + a y; every pixel holds the same
pattern, its middle is a sample, and the mean of the n positions is the pixel's centre.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Lattice:
    """The turned grid of integers a, b."""

    a: int
    b: int

    @property
    def samples(self) -> int:
        """Per pixel."""
        return self.a**2 + self.b**2

    def raster_size(self, width: int, height: int) -> tuple[int, int]:
        """Texels that hold an image of width x height pixels."""
        return self.a * width + self.b * height, self.b * width + self.a * height

    def raster_from_pixel(self, width: int) -> NDArray[np.float64]:
        """(2, 3) affine map from pixel coordinates (x, y, 1) to raster coordinates."""
        return np.array([[self.a, self.b, 0.0], [-self.b, self.a, self.b * width]])

    @cached_property
    def offsets(self) -> NDArray[np.int32]:
        """(n, 2) raster texels of a pixel, relative to the texel of its centre."""
        reach = np.arange(-self.a - self.b, self.a + self.b + 1)
        p, q = (g.ravel() for g in np.meshgrid(reach, reach, indexing="ij"))
        # In units of 1/n pixel; odd n keeps every sample off the pixel's border.
        x, y = self.a * p - self.b * q, self.b * p + self.a * q
        inside = (2 * np.abs(x) < self.samples) & (2 * np.abs(y) < self.samples)
        return np.stack([p[inside], q[inside]], axis=1).astype(np.int32)


LATTICES = {
    lattice.samples: lattice
    for lattice in (
        Lattice(1, 0),
        Lattice(2, 1),
        Lattice(3, 2),
        Lattice(4, 3),
        Lattice(6, 1),
        Lattice(10, 1),
        Lattice(20, 1),
    )
}
MAX_SAMPLES = max(LATTICES)

# Without an order a pixel averages at least this many samples: one is no anti-aliasing.
_FEWEST = 5


def choose_lattice(pixels: int, sample_budget: int) -> Lattice:
    """The finest lattice that puts at most ``sample_budget`` samples on so many pixels."""
    affordable = [n for n in LATTICES if n >= _FEWEST and n * pixels <= sample_budget]
    return LATTICES[max(affordable, default=_FEWEST)]
