"""Where a lens images a direction: pinhole with OpenCV's distortion, fisheye, double sphere.

All three map rays in camera axes (z boresight, x right, y down) to points of a normalised image
plane, as cameras are calibrated: a pinhole's plane at the distance 1. The camera turns these into
pixels by its focal lengths, skew and principal point.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from simgl.arrays import AnyArray, Array, Mask

# Newton's method doubles the correct digits in each step; invertible distortions need far fewer.
_NEWTON_STEPS = 12
_NEWTON_TOLERANCE = 1e-12
# Radii of a table from which it starts, and the angle up to which they reach: 89 deg.
_RADII, _WIDEST_RADIUS = 512, np.radians(89.0)
# Nodes of the table of angle by radius: cubic in between, its error is 1e-15 rad for smooth lenses.
_ANGLES = 1 << 13
# A lens that compresses its edge further images nothing there that it could resolve.
_MIN_SLOPE = 0.01


class Projection(ABC):
    """How a lens maps rays to points of its normalised image plane."""

    @abstractmethod
    def projected(self, rays: Array) -> Array:
        """Points (..., 2) of rays (..., 3) of any length; NaN where the lens does not see."""

    @abstractmethod
    def rays(self, points: Array) -> Array:
        """Rays (..., 3) of some length to points (..., 2); NaN where there is none."""

    @abstractmethod
    def area_per_steradian(self, rays: Array) -> Array:
        """(...,) area of the plane that a small solid angle about rays (..., 3) takes, per it."""

    @property
    @abstractmethod
    def scale(self) -> float:
        """Length in the plane per tangent of the angle off the boresight, next to it."""

    @property
    @abstractmethod
    def widest_angle(self) -> float:
        """Off the boresight, at which it still sees [rad]."""

    @property
    @abstractmethod
    def pupil_turns(self) -> bool:
        """Whether the entrance pupil faces every ray, as wide-angle lenses are built, or the
        boresight alone."""


@dataclass(frozen=True, kw_only=True)
class Distortion(Projection):
    """A pinhole with the distortion of OpenCV, for tangents x / z and y / z.

    x' = x s + 2 p1 x y + p2 (r^2 + 2 x^2) + s1 r^2 + s2 r^4,
    y' = y s + p1 (r^2 + 2 y^2) + 2 p2 x y + s3 r^2 + s4 r^4, with
    s = (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6);
    then seen on a detector tilted by tau_x and tau_y [rad] about the axes x and y.
    """

    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    k5: float = 0.0
    k6: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    s1: float = 0.0
    s2: float = 0.0
    s3: float = 0.0
    s4: float = 0.0
    tau_x: float = 0.0
    tau_y: float = 0.0

    def projected(self, rays: Array) -> Array:
        """As of every ``Projection``; a pinhole sees what lies before it, up to where its formula
        folds: OpenCV's would bring what is beyond back into the image."""
        with np.errstate(all="ignore"):
            tangents = rays[..., :2] / rays[..., 2:]
            sees = (rays[..., 2] > 0.0) & self._is_before_fold(tangents)
            return np.where(sees[..., None], self.distorted(tangents), np.nan)

    def rays(self, points: Array) -> Array:
        """As of every ``Projection``; z = 1."""
        tangents = self.undistorted(points)
        return np.concatenate([tangents, np.ones_like(tangents[..., :1])], axis=-1)

    def area_per_steradian(self, rays: Array) -> Array:
        """As of every ``Projection``."""
        tangents = rays[..., :2] / rays[..., 2:]
        secant2 = 1.0 + (tangents**2).sum(axis=-1)
        return np.linalg.det(self.jacobian(tangents)) * secant2 * np.sqrt(secant2)

    @property
    def scale(self) -> float:
        """As of every ``Projection``."""
        return 1.0

    @property
    def widest_angle(self) -> float:
        """As of every ``Projection``."""
        return 0.5 * np.pi

    @property
    def pupil_turns(self) -> bool:
        """As of every ``Projection``."""
        return False

    def distorted(self, tangents: Array) -> Array:
        """Distorted tangents (..., 2) of pinhole tangents (..., 2)."""
        points = self._bent(tangents)
        tilt = self._tilt
        return points if tilt is None else _mapped(tilt, points)

    def jacobian(self, tangents: Array) -> Array:
        """(..., 2, 2) derivative of ``distorted``; rows by result, columns by tangent."""
        slope, tilt = self._slope(tangents), self._tilt
        return slope if tilt is None else _map_slope(tilt, self._bent(tangents)) @ slope

    def undistorted(self, tangents: Array) -> Array:
        """Pinhole tangents (..., 2) of distorted tangents (..., 2); NaN where there are none."""
        tilt = self._tilt
        bent = tangents if tilt is None else _mapped(np.linalg.inv(tilt), tangents)
        # From there Newton's method does not leave for another branch.
        before, after = self._radii
        with np.errstate(all="ignore"):
            radius = np.hypot(bent[..., 0], bent[..., 1])
            shrinks = np.where(radius > 0.0, np.interp(radius, after, before) / radius, 1.0)
            result = bent * shrinks[..., None]
            for _ in range(_NEWTON_STEPS):
                rest = self._bent(result) - bent
                if np.abs(rest).max(initial=0.0) < _NEWTON_TOLERANCE:
                    break
                result = result - _solved(self._slope(result), rest)
            missed = np.abs(self._bent(result) - bent).max(axis=-1)
            converged = (missed < 1e-10) & self._is_before_fold(result)
        result[~converged] = np.nan
        return result

    def _is_before_fold(self, tangents: Array) -> Mask:
        """(...,) whether the picture is unfolded at tangents (..., 2) and, along the radius, up to
        them."""
        within = (tangents**2).sum(axis=-1) < self._fold
        return within & (np.linalg.det(self._slope(tangents)) > 0.0)

    @cached_property
    def _radii(self) -> tuple[Array, Array]:
        """Radii up to the fold before and after the radial distortion."""
        widest = min(np.arctan(np.sqrt(self._fold)), _WIDEST_RADIUS)
        before = np.tan(np.linspace(0.0, widest, _RADII + 1)[:-1])
        return before, before * self._scale(before * before)[0]

    @cached_property
    def _fold(self) -> float:
        """r^2 from which on the radial factor brings rays back, or where it has a pole."""
        above, below = (
            np.polynomial.Polynomial([1.0, *each])
            for each in ((self.k1, self.k2, self.k3), (self.k4, self.k5, self.k6))
        )
        # Where the derivative of r above / below by r is 0.
        twice_q = np.polynomial.Polynomial([0.0, 2.0])
        turn = above * below + twice_q * (above.deriv() * below - above * below.deriv())
        roots = np.concatenate([turn.trim().roots(), below.trim().roots()])
        real = roots.real[(np.abs(roots.imag) < 1e-9 * np.abs(roots)) & (roots.real > 0.0)]
        return float(real.min(initial=np.inf))

    def _bent(self, tangents: Array) -> Array:
        """``distorted`` without tilt."""
        x, y = tangents[..., 0], tangents[..., 1]
        q = x * x + y * y
        scale, _ = self._scale(q)
        across = x * scale + 2.0 * self.p1 * x * y + self.p2 * (q + 2.0 * x * x)
        down = y * scale + self.p1 * (q + 2.0 * y * y) + 2.0 * self.p2 * x * y
        if self._has_prism:
            across += q * (self.s1 + q * self.s2)
            down += q * (self.s3 + q * self.s4)
        return np.stack([across, down], axis=-1)

    def _slope(self, tangents: Array) -> Array:
        """``jacobian`` without tilt."""
        x, y = tangents[..., 0], tangents[..., 1]
        q = x * x + y * y
        scale, slope = self._scale(q)
        p1, p2 = self.p1, self.p2
        cross = 2.0 * x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y
        across = scale + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x
        down = scale + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x
        rows = [np.stack([across, cross], -1), np.stack([cross, down], -1)]
        if self._has_prism:
            # d(q s1 + q^2 s2) = (s1 + 2 q s2) dq, and dq = 2 x dx + 2 y dy.
            for row, (first, second) in zip(
                rows, ((self.s1, self.s2), (self.s3, self.s4)), strict=True
            ):
                row += 2.0 * (first + 2.0 * q * second)[..., None] * tangents
        return np.stack(rows, -2)

    def _scale(self, q: Array) -> tuple[Array, Array]:
        """Radial factor at r^2 = q, and its derivative by q."""
        above = 1.0 + q * (self.k1 + q * (self.k2 + q * self.k3))
        below = 1.0 + q * (self.k4 + q * (self.k5 + q * self.k6))
        above_slope = self.k1 + q * (2.0 * self.k2 + q * 3.0 * self.k3)
        below_slope = self.k4 + q * (2.0 * self.k5 + q * 3.0 * self.k6)
        return above / below, (above_slope * below - above * below_slope) / below**2

    @property
    def _has_prism(self) -> bool:
        return any((self.s1, self.s2, self.s3, self.s4))

    @property
    def _tilt(self) -> Array | None:
        """(3, 3) homography onto the tilted detector, None without tilt.

        The detector's plane goes through the point 1 on the axis; rays go on to it, and its own
        axes measure them.
        """
        if not (self.tau_x or self.tau_y):
            return None
        sin_x, cos_x = np.sin(self.tau_x), np.cos(self.tau_x)
        sin_y, cos_y = np.sin(self.tau_y), np.cos(self.tau_y)
        about_x = np.array([[1.0, 0.0, 0.0], [0.0, cos_x, sin_x], [0.0, -sin_x, cos_x]])
        about_y = np.array([[cos_y, 0.0, -sin_y], [0.0, 1.0, 0.0], [sin_y, 0.0, cos_y]])
        R = about_y @ about_x
        onto = np.array([[R[2, 2], 0.0, -R[0, 2]], [0.0, R[2, 2], -R[1, 2]], [0.0, 0.0, 1.0]])
        return onto @ R


class _Radial(Projection):
    """A lens symmetric about its boresight: the radius in the plane is a function of the angle."""

    def projected(self, rays: Array) -> Array:
        """As of every ``Projection``."""
        sine = np.hypot(rays[..., 0], rays[..., 1])
        angle = np.arctan2(sine, rays[..., 2])
        radius, _ = self.radius_and_slope(angle)
        with np.errstate(all="ignore"):
            # Next to the axis the direction has no length to divide by.
            per_side = np.where(sine > 0.0, radius / sine, self.scale / rays[..., 2])
            per_side = np.where(angle <= self.widest_angle, per_side, np.nan)
            return rays[..., :2] * per_side[..., None]

    def rays(self, points: Array) -> Array:
        """As of every ``Projection``; of length 1."""
        radius = np.hypot(points[..., 0], points[..., 1])
        angle = self._angle_by_radius(radius)
        with np.errstate(all="ignore"):
            per_side = np.where(radius > 0.0, np.sin(angle) / radius, 1.0 / self.scale)
        cosine = np.where(np.isnan(angle), np.nan, np.cos(angle))
        return np.concatenate([points * per_side[..., None], cosine[..., None]], axis=-1)

    def area_per_steradian(self, rays: Array) -> Array:
        """As of every ``Projection``: radius d(radius) over sin(angle) d(angle)."""
        sine = np.hypot(rays[..., 0], rays[..., 1]) / np.linalg.norm(rays, axis=-1)
        angle = np.arctan2(np.hypot(rays[..., 0], rays[..., 1]), rays[..., 2])
        radius, slope = self.radius_and_slope(angle)
        with np.errstate(all="ignore"):
            return np.where(sine > 0.0, radius / sine, self.scale) * slope

    @property
    def _angle_by_radius(self) -> Callable[[Array], Array]:
        """The inverse of ``radius_and_slope``; NaN beyond the widest angle."""
        # Denser towards the ends, where the slope may vanish.
        angles = 0.5 * self.widest_angle * (1.0 - np.cos(np.linspace(0.0, np.pi, _ANGLES)))
        radius, slope = self.radius_and_slope(angles)
        return scipy.interpolate.CubicHermiteSpline(radius, angles, 1.0 / slope, extrapolate=False)

    @abstractmethod
    def radius_and_slope(self, angle: Array) -> tuple[Array, Array]:
        """Radius in the plane at an angle off the boresight [rad], and its derivative."""

    @property
    def pupil_turns(self) -> bool:
        """As of every ``Projection``."""
        return True

    @property
    def widest_angle(self) -> float:
        """As of every ``Projection``: up to which the radius grows, by at least a hundredth of what
        it does at first."""
        angles = np.linspace(0.0, np.pi, _ANGLES)
        with np.errstate(all="ignore"):
            grows = self.radius_and_slope(angles)[1] > _MIN_SLOPE * self.scale
        return float(angles[-1] if grows.all() else angles[max(int(np.argmin(grows)) - 1, 0)])


@dataclass(frozen=True, kw_only=True)
class Fisheye(_Radial):
    """OpenCV's fisheye lens (Kannala and Brandt 2006), all coefficients 0 for an equidistant one.

    radius = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8) at theta off the axis.
    """

    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0

    def radius_and_slope(self, angle: Array) -> tuple[Array, Array]:
        """As of every radial lens."""
        q = angle * angle
        radius = angle * (1.0 + q * (self.k1 + q * (self.k2 + q * (self.k3 + q * self.k4))))
        slope = 1.0 + q * (
            3.0 * self.k1 + q * (5.0 * self.k2 + q * (7.0 * self.k3 + q * 9.0 * self.k4))
        )
        return radius, slope

    @property
    def scale(self) -> float:
        """As of every ``Projection``."""
        return 1.0


@dataclass(frozen=True, kw_only=True)
class DoubleSphere(_Radial):
    """The double sphere model (Usenko, Demmel and Cremers 2018).

    A ray's point on a first unit sphere, seen from a second sphere whose centre lies ``xi`` ahead,
    seen by a pinhole that lies alpha / (1 - alpha) behind; alpha 0..1, xi above -1.
    """

    xi: float
    alpha: float

    def radius_and_slope(self, angle: Array) -> tuple[Array, Array]:
        """As of every radial lens."""
        sine, cosine = np.sin(angle), np.cos(angle)
        ahead = self.xi + cosine
        second = np.sqrt(sine * sine + ahead * ahead)
        depth = self.alpha * second + (1.0 - self.alpha) * ahead
        # NaN beyond the last ray that meets the plane in its one place.
        depth = np.where(depth > 0.0, depth, np.nan)
        depth_slope = -sine * (self.alpha * self.xi / second + 1.0 - self.alpha)
        return sine / depth, (cosine * depth - sine * depth_slope) / depth**2

    @property
    def scale(self) -> float:
        """As of every ``Projection``."""
        return 1.0 / (1.0 + self.xi)


def _mapped(homography: AnyArray, points: Array) -> Array:
    """Points (..., 2) under a homography (3, 3)."""
    x, y = points[..., 0], points[..., 1]
    a, b, c = (row[0] * x + row[1] * y + row[2] for row in homography)
    return np.stack([a / c, b / c], axis=-1)


def _map_slope(homography: Array, points: Array) -> Array:
    """(..., 2, 2) derivative of ``_mapped`` at points (..., 2)."""
    depth = points @ homography[2, :2] + homography[2, 2]
    rows = homography[:2, :2] - _mapped(homography, points)[..., :, None] * homography[2, :2]
    return rows / depth[..., None, None]


def _solved(matrix: Array, right: Array) -> Array:
    """Solution of (..., 2, 2) linear equations by Cramer's rule; not finite where there is none."""
    (a, b), (c, d) = np.moveaxis(matrix, (-2, -1), (0, 1))
    x, y = right[..., 0], right[..., 1]
    return np.stack([d * x - b * y, a * y - c * x], -1) / (a * d - b * c)[..., None]
