"""A lens as data: aperture, vignetting, distortion, point spread, stray light, surfaces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from simgl.arrays import Array

# Newton's method doubles the correct digits in each step; invertible distortions need far fewer.
_NEWTON_STEPS = 12
_NEWTON_TOLERANCE = 1e-12


@dataclass(frozen=True, kw_only=True)
class Distortion:
    """Brown-Conrady distortion in OpenCV's convention, for tangents x / z and y / z.

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
        """Distorted tangents (..., 2) of pinhole tangents (..., 2)."""
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
        """(..., 2, 2) derivative of ``distorted``; rows by result, columns by tangent."""
        x, y = tangents[..., 0], tangents[..., 1]
        scale, slope = self._scale(x * x + y * y)
        p1, p2 = self.p1, self.p2
        cross = 2.0 * x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y
        across = scale + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x
        down = scale + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x
        return np.stack([np.stack([across, cross], -1), np.stack([cross, down], -1)], -2)

    def undistorted(self, tangents: Array) -> Array:
        """Pinhole tangents (..., 2) of distorted tangents (..., 2); NaN where there are none."""
        result = np.array(tangents, dtype=np.float64)
        with np.errstate(all="ignore"):
            for _ in range(_NEWTON_STEPS):
                rest = self.distorted(result) - tangents
                if np.abs(rest).max(initial=0.0) < _NEWTON_TOLERANCE:
                    break
                result = result - _solved(self.jacobian(result), rest)
            missed = np.abs(self.distorted(result) - tangents).max(axis=-1)
            folded = np.linalg.det(self.jacobian(result)) <= 0.0
        result[~(missed < 1e-10) | folded] = np.nan
        return result

    def _scale(self, q: Array) -> tuple[Array, Array]:
        """Radial factor at r^2 = q, and its derivative by q."""
        above = 1.0 + q * (self.k1 + q * (self.k2 + q * self.k3))
        below = 1.0 + q * (self.k4 + q * (self.k5 + q * self.k6))
        above_slope = self.k1 + q * (2.0 * self.k2 + q * 3.0 * self.k3)
        below_slope = self.k4 + q * (2.0 * self.k5 + q * 3.0 * self.k6)
        return above / below, (above_slope * below - above * below_slope) / below**2


def _solved(matrix: Array, right: Array) -> Array:
    """Solution of (..., 2, 2) linear equations by Cramer's rule; not finite where there is none."""
    (a, b), (c, d) = np.moveaxis(matrix, (-2, -1), (0, 1))
    x, y = right[..., 0], right[..., 1]
    return np.stack([d * x - b * y, a * y - c * x], -1) / (a * d - b * c)[..., None]


@dataclass(frozen=True, kw_only=True)
class Vignetting:
    """Irradiance off the axis, relative to the axis.

    natural : cos^4 of the angle divided by the stretch of the distortion, as in a thin lens
    angles, relative : instead, a profile measured on flat fields that includes all effects, linear
        between its angles [rad]; empty for none
    """

    natural: bool = True
    angles: tuple[float, ...] = ()
    relative: tuple[float, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Blur:
    """Blur besides diffraction.

    aberration : standard deviation of a Gaussian in the image plane [m]
    defocus : from the plane of best focus to the detector [m]
    """

    aberration: float = 0.0
    defocus: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Zone:
    """Blur at a distance from the image centre; ``share`` is 0..1 of the half diagonal."""

    share: float
    blur: Blur


@dataclass(frozen=True, kw_only=True)
class PointSpread:
    """The point spread function.

    diffraction : of a circular pupil, by band and f-number
    zones : at least one, by increasing share; between two zones their images are mixed
    image : instead, rows of a measured point spread, non-negative, centred on the point
    image_scale : samples of ``image`` per pixel along an edge
    """

    diffraction: bool = True
    zones: tuple[Zone, ...] = (Zone(share=0.0, blur=Blur()),)
    image: tuple[tuple[float, ...], ...] | None = None
    image_scale: int = 1


@dataclass(frozen=True, kw_only=True)
class LensSurface:
    """A refracting surface of a lens.

    radius : of curvature [m], positive if the centre lies behind the surface; infinite for a plane
    gap : to the next surface [m]; ignored for the last one
    index : of refraction of the medium behind the surface
    reflectance : of the coating, 0..1
    """

    radius: float
    gap: float
    index: float
    reflectance: float


@dataclass(frozen=True, kw_only=True)
class Lens:
    """A lens.

    focal_length : [m]
    transmission : per band R, G, B, N, 0..1
    camera_equation : "4N2", pi L T / (4 N^2), for a distant object and an aplanatic lens; or
        "1+4N2", for a thin lens with a plane pupil
    distortion, spread : None for none
    veiling_glare : fraction of the light that is scattered uniformly over the image
    surfaces : from front to back, for ghosts of the Sun; scaled to the focal length; empty for none
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
