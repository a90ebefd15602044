"""How much sunlight a point in space gets past the Earth, its air, and the Moon."""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array
from simgl.physics.atmosphere import (
    AIR_TOP,
    Atmosphere,
    grazing_optical_depth,
    optical_depth_to_space,
)
from simgl.physics.constants import MOON_RADIUS
from simgl.physics.frames import angle_between
from simgl.physics.solar_disc import UNIFORM, limb_profile

# Above this tangent height the air takes less than 1e-5 of any band [m].
HIGHEST = 120e3

# Where the Sun stands so far above the horizontal [rad], the air dims its disc evenly: to 1e-4.
_HIGH = 0.5

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(64)
# Along one arc of the disc, where the profile is a smooth function of the sine's angle.
_ACROSS_NODES, _ACROSS_WEIGHTS = np.polynomial.legendre.leggauss(16)


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


def visible_light_fraction(
    disc_radius: float, body_radius: float, separation: float, limb: Array
) -> Array:
    """(4,) fraction of a small disc's light that comes from outside a circular body.

    disc_radius, body_radius, separation : as for ``visible_disc_fraction``
    limb : (2, 4) darkening of the disc towards its limb; uniform is the other function's result

    The disc is cut into rings about its own centre, each with the angle that the body hides of it
    by the half-angle formula of spherical trigonometry.
    """
    if not limb.any():
        return np.full(4, visible_disc_fraction(disc_radius, body_radius, separation))
    # A ring is hidden in part between these two radii.
    first = min(abs(separation - body_radius), disc_radius)
    last = min(separation + body_radius, disc_radius)
    hidden, whole = np.zeros(4), np.zeros(4)
    for low, high in ((0.0, first), (first, last), (last, disc_radius)):
        # r = R sin t takes out the root of the profile at the limb, the cosine those of the angle.
        start, end = np.arcsin(low / disc_radius), np.arcsin(high / disc_radius)
        turn = 0.5 * np.pi * (_NODES + 1.0)
        t = start + 0.5 * (end - start) * (1.0 - np.cos(turn))
        r = disc_radius * np.sin(t)
        step = 0.25 * np.pi * (end - start) * np.sin(turn) * _WEIGHTS * disc_radius * np.cos(t)
        light = (np.sin(r) * step)[:, None] * limb_profile(np.cos(t), limb)
        whole += np.sum(light, axis=0)
        hidden += _hidden_share(r, body_radius, separation) @ light
    return np.clip(1.0 - hidden / whole, 0.0, 1.0)


def _hidden_share(r: Array, body_radius: float, separation: float) -> Array:
    """(k,) share of circles of radii (k,) that a circular body hides, its centre off theirs."""
    half = 0.5 * (r + body_radius + separation)
    # Negative where no triangle closes: the circle lies wholly inside the body or outside it.
    inside = np.sin(half - r) * np.sin(half - separation)
    outside = np.sin(half) * np.sin(half - body_radius)
    roots = np.sqrt(np.maximum([inside, outside], 0.0))
    return 2.0 / np.pi * np.arctan2(roots[0], roots[1])


def _arc_profile(disc_radius: float, separation: float, theta: Array, limb: Array) -> Array:
    """(k, 4) mean of a disc's profile along the arcs that ``_arcs`` cuts, at distances (k,)."""
    # With haversines, mu^2 = 1 - hav(r) / hav(disc_radius), and along an arc of half-width w
    # hav(r) = hav(theta - separation) + sin(theta) sin(separation) hav(angle).
    stretch = np.sin(theta) * np.sin(separation) / np.sin(0.5 * disc_radius) ** 2
    top = 1.0 - (np.sin(0.5 * (theta - separation)) / np.sin(0.5 * disc_radius)) ** 2
    half_width = 2.0 * np.arcsin(np.sqrt(np.clip(top / stretch, 0.0, 1.0)))
    turn = 0.5 * np.pi * _ACROSS_NODES
    angle = half_width[:, None] * np.sin(turn)
    mu2 = top[:, None] - stretch[:, None] * np.sin(0.5 * angle) ** 2
    profile = limb_profile(np.sqrt(np.clip(mu2, 0.0, 1.0)), limb)
    weight = 0.25 * np.pi * np.cos(turn) * _ACROSS_WEIGHTS
    return np.einsum("j,kjb->kb", weight, profile)


def sunlit_shares(
    position: Array,
    sun_direction: Array,
    sun_angular_radius: float,
    radii: Array,
    limb: Array,
) -> Array:
    """(4,) fraction of the Sun's light in each band that passes an ellipsoid without atmosphere.

    position : (3,) from the ellipsoid's centre, in its axes [m]; outside it
    sun_direction : (3,) unit, in the same axes
    sun_angular_radius : [rad]
    radii : (3,) semi-axes [m]
    limb : (2, 4) limb darkening of the Sun's disc
    """
    separation = angle_between(-position, sun_direction)
    if separation - sun_angular_radius > 0.5 * np.pi:
        return np.ones(4)
    edge = limb_angle(position, sun_direction, radii)
    return visible_light_fraction(sun_angular_radius, edge, separation, limb)


def sunlit_transmission(
    position: Array,
    sun_direction: Array,
    sun_angular_radius: float,
    radii: Array,
    air: Atmosphere,
    limb: Array = UNIFORM,
) -> Array:
    """(4,) share of the Sun's light in each band that reaches a point past the Earth and its air.

    The disc's mean of the transmission along each grazing ray, zero where the ray meets the ground.
    Arguments as for ``sunlit_shares``; the point may lie inside the air.
    """
    separation = angle_between(-position, sun_direction)
    distance = float(np.linalg.norm(position))
    # Heights at a place are taken above the sphere through the ellipsoid's point below it.
    below = distance / float(np.linalg.norm(position / radii))
    inside = distance - below < AIR_TOP
    if inside and separation > 0.5 * np.pi + _HIGH:
        cosine = np.array([-np.cos(separation)])
        return np.exp(-optical_depth_to_space(air, below, distance - below, cosine)[0])
    if not inside and separation - sun_angular_radius > 0.5 * np.pi:
        return np.ones(4)
    edge = limb_angle(position, sun_direction, radii)
    low, high = separation - sun_angular_radius, separation + sun_angular_radius
    # The sphere that has the ellipsoid's limb on this side.
    radius = distance * float(np.sin(edge))
    if high <= edge:
        return np.zeros(4)
    if not inside and low >= edge and distance * np.sin(low) - radius > HIGHEST:
        return np.ones(4)
    outside, theta = _arcs(sun_angular_radius, separation, max(edge, low))
    whole, everywhere = _arcs(sun_angular_radius, separation, low)
    if inside:
        depth = optical_depth_to_space(air, radius, distance - radius, -np.cos(theta))
    else:
        depth = grazing_optical_depth(air, radius, distance * np.sin(theta) - radius)
    if not limb.any():
        return outside @ np.exp(-depth) / np.sum(whole)
    seen = _arc_profile(sun_angular_radius, separation, theta, limb)
    total = _arc_profile(sun_angular_radius, separation, everywhere, limb)
    return outside @ (seen * np.exp(-depth)) / (whole @ total)


def past_the_moon(
    point: Array,
    moon: Array,
    sun_direction: Array,
    sun_angular_radius: float,
    limb: Array = UNIFORM,
) -> Array:
    """(4,) share of the Sun's light that a point (3,) gets past the Moon's centre at (3,) [m].

    limb : (2, 4) darkening of the Sun's disc
    """
    offset = moon - point
    distance = float(np.linalg.norm(offset))
    separation = angle_between(offset, sun_direction)
    moon_angular_radius = float(np.arcsin(MOON_RADIUS / distance))
    return visible_light_fraction(sun_angular_radius, moon_angular_radius, separation, limb)
