"""How much sunlight a point in space gets past the Earth, its air, and the Moon."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simgl.physics.air import Atmosphere, grazing_optical_depth
from simgl.physics.constants import MOON_RADIUS

Array = NDArray[np.float64]

# Above this tangent height the air takes less than 1e-5 of any band [m].
AIR_TOP = 120e3

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(64)


def limb_angle(position: Array, direction: Array, radii: Array) -> float:
    """Angle between nadir and the ellipsoid's limb on the side of a direction [rad].

    position : (3,) observer from the ellipsoid's centre, in its own axes [m], outside it
    direction : (3,) unit; the limb is sought in the plane of nadir and this direction
    radii : (3,) semi-axes [m]

    A ray grazes where the discriminant of its intersection with the unit sphere vanishes, after
    space is scaled by the semi-axes; that is a quadratic in the tangent of the angle.
    """
    nadir = -position / np.linalg.norm(position)
    side = direction - np.dot(direction, nadir) * nadir
    length = float(np.linalg.norm(side))
    if length < 1e-12:
        side = np.cross(nadir, np.eye(3)[int(np.argmin(np.abs(nadir)))])
        length = float(np.linalg.norm(side))
    side = side / length
    o, n, e = position / radii, nadir / radii, side / radii
    c = float(np.dot(o, o)) - 1.0
    p, q = float(np.dot(o, n)), float(np.dot(o, e))
    a2 = q * q - c * float(np.dot(e, e))
    a1 = p * q - c * float(np.dot(n, e))
    a0 = p * p - c * float(np.dot(n, n))
    # Outside the ellipsoid a2 < 0 < a0, so exactly one tangent is positive.
    tangent = (-a1 - np.sqrt(a1 * a1 - a2 * a0)) / a2
    return float(np.arctan(tangent))


def _overlap(a: float, b: float, d: float) -> float:
    """Solid angle common to two circles on the sky of radii a, b at a distance d < a + b [sr].

    Sectors less triangles (Tovchigrechko & Vakser 2001). The rounding of the cosines leaves 1e-8
    of a disc as small as the Sun's, which is why the quadrature below serves where it can.
    """
    if d <= abs(a - b):
        return float(4.0 * np.pi * np.sin(0.5 * min(a, b)) ** 2)
    ca, cb, cd = np.cos([a, b, d])
    sa, sb, sd = np.sin([a, b, d])
    corner = np.arccos(np.clip((cd - ca * cb) / (sa * sb), -1.0, 1.0))
    at_a = np.arccos(np.clip((cb - cd * ca) / (sd * sa), -1.0, 1.0))
    at_b = np.arccos(np.clip((ca - cd * cb) / (sd * sb), -1.0, 1.0))
    return float(2.0 * (np.pi - corner - at_a * ca - at_b * cb))


def visible_disc_fraction(disc_radius: float, body_radius: float, separation: float) -> float:
    """Fraction of a small disc's solid angle that lies outside a circular body.

    All three are angles on the sky [rad]: the disc's radius, the body's radius, and the distance of
    their centres. Exact on the sphere: the disc is cut into arcs about the body's centre, each with
    the half-width of spherical trigonometry, and integrated by Gauss-Legendre quadrature after a
    substitution that removes the square-root ends. Where the disc reaches over the body's centre,
    as in deep space, the overlap is taken in closed form.
    """
    low, high = separation - disc_radius, separation + disc_radius
    if body_radius <= low:
        return 1.0
    if body_radius >= high:
        return 0.0
    if low < 0.0:
        solid_angle = 4.0 * np.pi * np.sin(0.5 * disc_radius) ** 2
        return 1.0 - _overlap(disc_radius, body_radius, separation) / float(solid_angle)

    outside, _ = _arcs(disc_radius, separation, body_radius)
    whole, _ = _arcs(disc_radius, separation, low)
    return float(np.sum(outside) / np.sum(whole))


def _arcs(disc_radius: float, separation: float, start: float) -> tuple[Array, Array]:
    """The part of a disc outside a circle about another centre, cut into arcs about that centre.

    start : radius of the circle [rad], between separation - disc_radius and + disc_radius
    returns : (k,) solid angle of each arc [sr], and (k,) its distance from the centre [rad]
    """
    # theta = separation - disc_radius cos(phi): arcs vanish smoothly at both ends.
    first = float(np.arccos(np.clip((separation - start) / disc_radius, -1.0, 1.0)))
    phi = first + 0.5 * (np.pi - first) * (_NODES + 1.0)
    theta = separation - disc_radius * np.cos(phi)
    cosine = (np.cos(disc_radius) - np.cos(theta) * np.cos(separation)) / (
        np.sin(theta) * np.sin(separation)
    )
    half_width = np.arccos(np.clip(cosine, -1.0, 1.0))
    step = 0.5 * (np.pi - first) * _WEIGHTS * disc_radius * np.sin(phi)
    return 2.0 * half_width * np.sin(theta) * step, theta


def _from_nadir(position: Array, direction: Array) -> float:
    """Angle between a direction and the one to the centre [rad]."""
    nadir = -position / np.linalg.norm(position)
    cross = float(np.linalg.norm(np.cross(nadir, direction)))
    return float(np.arctan2(cross, np.dot(nadir, direction)))


def sunlit_fraction(
    position: Array, sun_direction: Array, sun_angular_radius: float, radii: Array
) -> float:
    """Fraction of the Sun's disc visible past an ellipsoid without atmosphere.

    position : (3,) from the ellipsoid's centre, in its axes [m]; outside it
    sun_direction : (3,) unit, in the same axes
    sun_angular_radius : [rad]
    radii : (3,) semi-axes [m]
    """
    separation = _from_nadir(position, sun_direction)
    if separation - sun_angular_radius > 0.5 * np.pi:
        return 1.0
    limb = limb_angle(position, sun_direction, radii)
    return visible_disc_fraction(sun_angular_radius, limb, separation)


def sunlit_transmission(
    position: Array,
    sun_direction: Array,
    sun_angular_radius: float,
    radii: Array,
    air: Atmosphere,
) -> Array:
    """(4,) share of the Sun's light in each band that reaches a point past the Earth and its air.

    The disc's mean of the transmission along each grazing ray, zero where the ray meets the ground.
    Arguments as for ``sunlit_fraction``; the point lies above the air.
    """
    separation = _from_nadir(position, sun_direction)
    if separation - sun_angular_radius > 0.5 * np.pi:
        return np.ones(4)
    limb = limb_angle(position, sun_direction, radii)
    distance = float(np.linalg.norm(position))
    low, high = separation - sun_angular_radius, separation + sun_angular_radius
    # The sphere that has the ellipsoid's limb on this side.
    radius = distance * float(np.sin(limb))
    if high <= limb:
        return np.zeros(4)
    if low >= limb and distance * np.sin(low) - radius > AIR_TOP:
        return np.ones(4)
    outside, theta = _arcs(sun_angular_radius, separation, max(limb, low))
    whole, _ = _arcs(sun_angular_radius, separation, low)
    depth = grazing_optical_depth(air, radius, distance * np.sin(theta) - radius)
    return np.asarray(outside @ np.exp(-depth) / np.sum(whole))


def past_the_moon(
    point: Array, moon: Array, sun_direction: Array, sun_angular_radius: float
) -> float:
    """Fraction of the Sun's disc that a point (3,) sees past the Moon's centre at (3,) [m]."""
    offset = moon - point
    distance = float(np.linalg.norm(offset))
    separation = _from_nadir(-offset, sun_direction)
    moon_angular_radius = float(np.arcsin(MOON_RADIUS / distance))
    return visible_disc_fraction(sun_angular_radius, moon_angular_radius, separation)
