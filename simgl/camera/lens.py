"""A lens as data: aperture, vignetting, distortion, point spread, stray light."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from simgl.arrays import Array

# Newton's method doubles the correct digits at each turn; twelve are far more than it needs where
# the distortion can be inverted at all.
_NEWTON_TURNS = 12
_NEWTON_DONE = 1e-12


@dataclass(frozen=True, kw_only=True)
class Distortion:
    """Brown-Conrady distortion in OpenCV's convention, of tangents x / z and y / z.

    x' = x s + 2 p1 x y + p2 (r^2 + 2 x^2), y' = y s + p1 (r^2 + 2 y^2) + 2 p2 x y, with
    s = (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6).
    """

    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    k5: float = 0.0
    k6: float = 0.0
    p1: float = 0.0
    p2: float = 0.0

    def distorted(self, tangents: Array) -> Array:
        """Where tangents (..., 2) of a pinhole come to lie."""
        x, y = tangents[..., 0], tangents[..., 1]
        q = x * x + y * y
        scale, _ = self._scale(q)
        return np.stack(
            [
                x * scale + 2.0 * self.p1 * x * y + self.p2 * (q + 2.0 * x * x),
                y * scale + self.p1 * (q + 2.0 * y * y) + 2.0 * self.p2 * x * y,
            ],
            axis=-1,
        )

    def jacobian(self, tangents: Array) -> Array:
        """(..., 2, 2) derivative of ``distorted``; row of the result, column of the tangent."""
        x, y = tangents[..., 0], tangents[..., 1]
        scale, slope = self._scale(x * x + y * y)
        p1, p2 = self.p1, self.p2
        cross = 2.0 * x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y
        across = scale + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x
        down = scale + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x
        return np.stack([np.stack([across, cross], -1), np.stack([cross, down], -1)], -2)

    def undistorted(self, tangents: Array) -> Array:
        """The pinhole tangents (..., 2) that come to lie at these; NaN where there are none."""
        found = np.array(tangents, dtype=np.float64)
        with np.errstate(all="ignore"):
            for _ in range(_NEWTON_TURNS):
                rest = self.distorted(found) - tangents
                if np.abs(rest).max(initial=0.0) < _NEWTON_DONE:
                    break
                found = found - _solved(self.jacobian(found), rest)
            missed = np.abs(self.distorted(found) - tangents).max(axis=-1)
            folded = np.linalg.det(self.jacobian(found)) <= 0.0
        found[~(missed < 1e-10) | folded] = np.nan
        return found

    def _scale(self, q: Array) -> tuple[Array, Array]:
        """Radial factor at r^2 = q, and its derivative by q."""
        above = 1.0 + q * (self.k1 + q * (self.k2 + q * self.k3))
        below = 1.0 + q * (self.k4 + q * (self.k5 + q * self.k6))
        above_slope = self.k1 + q * (2.0 * self.k2 + q * 3.0 * self.k3)
        below_slope = self.k4 + q * (2.0 * self.k5 + q * 3.0 * self.k6)
        return above / below, (above_slope * below - above * below_slope) / below**2


def _solved(matrix: Array, right: Array) -> Array:
    """Solution of (..., 2, 2) equations by Cramer's rule; infinite where there is none."""
    (a, b), (c, d) = np.moveaxis(matrix, (-2, -1), (0, 1))
    x, y = right[..., 0], right[..., 1]
    return np.stack([d * x - b * y, a * y - c * x], -1) / (a * d - b * c)[..., None]


@dataclass(frozen=True, kw_only=True)
class Vignetting:
    """Irradiance off the axis, relative to the axis.

    natural : cos^4 of the angle, divided by the stretch of the distortion: what a thin lens does
    angles, relative : a profile measured on flat fields instead, linear between its angles [rad]
        and with all effects in it; empty where there is none
    """

    natural: bool = True
    angles: tuple[float, ...] = ()
    relative: tuple[float, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Blur:
    """What a point becomes, besides diffraction.

    aberration : standard deviation of a Gaussian [m], in the image plane
    defocus : from the plane of best focus to the detector [m]
    """

    aberration: float = 0.0
    defocus: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Zone:
    """Blur at a distance from the principal point, a share 0..1 of the half diagonal."""

    share: float
    blur: Blur


@dataclass(frozen=True, kw_only=True)
class PointSpread:
    """The point spread function.

    diffraction : of a circular pupil, by band and f-number
    zones : of increasing share, at least one; between two of them their images are mixed
    image : measured values instead of diffraction and blur, rows of the image, 0 or more; its
        middle is the point
    image_scale : samples of ``image`` along the edge of a pixel
    """

    diffraction: bool = True
    zones: tuple[Zone, ...] = (Zone(share=0.0, blur=Blur()),)
    image: tuple[tuple[float, ...], ...] | None = None
    image_scale: int = 1


@dataclass(frozen=True, kw_only=True)
class LensSurface:
    """One refracting surface of a lens, from front to back.

    radius : of curvature [m], positive where its centre lies behind it; infinite for a plane
    gap : to the next surface [m]; of the last surface it does not count
    index : of the medium behind it
    reflectance : of its coating, 0..1
    """

    radius: float
    gap: float
    index: float
    reflectance: float


@dataclass(frozen=True, kw_only=True)
class Lens:
    """focal_length [m]; f_number; transmission per band R, G, B, N, 0..1.

    camera_equation : "4N2", pi L T / (4 N^2), of a distant object and an aplanatic lens, or
        "1+4N2", of a thin lens whose pupil is a plane disc
    distortion, spread : None where there is none
    veiling_glare : share of the light that is scattered evenly over the picture
    surfaces : give the Sun's ghosts; scaled to the focal length; empty where there are none
    """

    focal_length: float
    f_number: float
    transmission: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    camera_equation: Literal["4N2", "1+4N2"] = "4N2"
    vignetting: Vignetting = Vignetting()
    distortion: Distortion | None = None
    spread: PointSpread | None = None
    veiling_glare: float = 0.0
    surfaces: tuple[LensSurface, ...] = ()
