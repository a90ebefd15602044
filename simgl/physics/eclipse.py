"""Sunlight at a point in space: eclipse by the Earth, its atmosphere, and the Moon."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy

from simgl.arrays import Array
from simgl.physics.air_profile import AIR_TOP
from simgl.physics.atmosphere import Air, band_transmittance, optical_depth_to_space
from simgl.physics.constants import MOON_RADIUS
from simgl.physics.frames import angle_between, cross, norm
from simgl.physics.refraction import BentRays, rays_from_inside, rays_from_space
from simgl.physics.solar_disc import UNIFORM, limb_profile

# Above this elevation of the Sun [rad] the transmission is uniform over its disc to 1e-4.
_HIGH = 0.5

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(64)
# Along one arc of the disc, where the limb profile is a smooth function of arcsin(position).
_ACROSS_NODES, _ACROSS_WEIGHTS = np.polynomial.legendre.leggauss(16)


def limb_angle(position: Array, direction: Array, radii: Array) -> float:
    """Angle between nadir and the ellipsoid's limb on the side of a direction (3,) [rad].

    As ``limb_angles``; straight down any side will do.
    """
    nadir = -position / norm(position)
    if norm(cross(nadir, direction)) < 1e-12:
        direction = np.eye(3)[int(np.argmin(np.abs(nadir)))]
    return float(limb_angles(position, direction[None], radii)[0])


def limb_angles(position: Array, directions: Array, radii: Array) -> Array:
    """(n,) angles between nadir and the ellipsoid's limb on the sides of directions [rad].

    position : (3,) observer outside the ellipsoid, from its centre in its axes [m]
    directions : (n, 3) unit; each gives with nadir the plane of a limb point
    radii : (3,) semi-axes [m]

    With space scaled by the semi-axes, a ray is tangent where the discriminant of its intersection
    with the unit sphere vanishes: a quadratic in the tangent of the angle.
    """
    nadir = -position / norm(position)
    sides = directions - np.outer(directions @ nadir, nadir)
    sides /= np.linalg.norm(sides, axis=1)[:, None]
    o, n, e = position / radii, nadir / radii, sides / radii
    c = float(np.dot(o, o)) - 1.0
    p, q = float(np.dot(o, n)), e @ o
    a2 = q * q - c * np.sum(e * e, axis=1)
    a1 = p * q - c * (e @ n)
    a0 = p * p - c * float(np.dot(n, n))
    # Outside the ellipsoid a2 < 0 < a0, so exactly one tangent is positive.
    tangents: Array = (-a1 - np.sqrt(a1 * a1 - a2 * a0)) / a2
    return np.arctan(tangents)


def _overlap(a: float, b: float, d: float) -> float:
    """Solid angle common to two circles on the sky of radii a, b, centres d < a + b apart [sr].

    Sectors less triangles (Tovchigrechko & Vakser 2001). Rounding of the cosines gives an error of
    1e-8 for a disc as small as the Sun's, so the quadrature of ``_arcs`` is used where it applies.
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

    disc_radius, body_radius, separation : angular radii and distance of the centres [rad]

    Exact on the sphere: the disc is cut into arcs about the body's centre, with half-widths by
    spherical trigonometry, and integrated by Gauss-Legendre quadrature after a substitution that
    removes the square-root singularities at the ends. Where the disc covers the body's centre, as
    in deep space, the overlap has a closed form.
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
    complete, _ = _arcs(disc_radius, separation, low)
    return float(np.sum(outside) / np.sum(complete))


def _arcs(disc_radius: float, separation: float, start: float) -> tuple[Array, Array]:
    """Arcs about another centre that make up the part of a disc outside a circle about that centre.

    start : radius of the circle [rad], between separation - disc_radius and + disc_radius
    returns : (k,) solid angle of each arc [sr], and (k,) its distance from the other centre [rad]
    """
    # theta = separation - disc_radius cos(phi): arcs vanish smoothly at both ends.
    first = float(np.arccos(np.clip((separation - start) / disc_radius, -1.0, 1.0)))
    phi = first + 0.5 * (np.pi - first) * (_NODES + 1.0)
    widths, theta = _arc_widths(disc_radius, separation, phi)
    return widths * 0.5 * (np.pi - first) * _WEIGHTS * disc_radius * np.sin(phi), theta


def _arc_widths(disc_radius: float, separation: float, phi: Array) -> tuple[Array, Array]:
    """(k,) lengths of the arcs at theta = separation - disc_radius cos(phi), and (k,) theta."""
    theta = separation - disc_radius * np.cos(phi)
    cosine = (np.cos(disc_radius) - np.cos(theta) * np.cos(separation)) / (
        np.sin(theta) * np.sin(separation)
    )
    return 2.0 * np.arccos(np.clip(cosine, -1.0, 1.0)) * np.sin(theta), theta


def visible_light_fraction(
    disc_radius: float, body_radius: float, separation: float, limb: Array
) -> Array:
    """(4,) fraction of a small disc's light that a circular body does not occult.

    disc_radius, body_radius, separation : as for ``visible_disc_fraction`` [rad]
    limb : (2, 4) limb darkening of the disc

    The disc is cut into rings about its centre; the occulted angle of each ring follows from the
    half-angle formula of spherical trigonometry.
    """
    if not limb.any():
        return np.full(4, visible_disc_fraction(disc_radius, body_radius, separation))
    if body_radius >= separation + disc_radius:
        # The rings' sum would leave its rounding.
        return np.zeros(4)
    # Rings between these two radii are partly occulted.
    first = min(abs(separation - body_radius), disc_radius)
    last = min(separation + body_radius, disc_radius)
    hidden, complete = np.zeros(4), np.zeros(4)
    for low, high in ((0.0, first), (first, last), (last, disc_radius)):
        # r = R sin t removes the square root of the profile at the limb, the cosine spacing of t
        # those of the occulted angle.
        start, end = np.arcsin(low / disc_radius), np.arcsin(high / disc_radius)
        turn = 0.5 * np.pi * (_NODES + 1.0)
        t = start + 0.5 * (end - start) * (1.0 - np.cos(turn))
        r = disc_radius * np.sin(t)
        step = 0.25 * np.pi * (end - start) * np.sin(turn) * _WEIGHTS * disc_radius * np.cos(t)
        light = (np.sin(r) * step)[:, None] * limb_profile(np.cos(t), limb)
        complete += np.sum(light, axis=0)
        hidden += _hidden_share(r, body_radius, separation) @ light
    return np.clip(1.0 - hidden / complete, 0.0, 1.0)


def _hidden_share(r: Array, body_radius: float, separation: float) -> Array:
    """(k,) occulted fraction of circles of radii (k,) about a centre off the body's [rad]."""
    half = 0.5 * (r + body_radius + separation)
    # Negative where no triangle closes: the circle lies entirely inside the body or outside it.
    inside = np.sin(half - r) * np.sin(half - separation)
    outside = np.sin(half) * np.sin(half - body_radius)
    roots = np.sqrt(np.maximum([inside, outside], 0.0))
    return 2.0 / np.pi * np.arctan2(roots[0], roots[1])


def _arc_profile(disc_radius: float, separation: float, theta: Array, limb: Array) -> Array:
    """(k, 4) mean of a disc's limb profile along the arcs of ``_arcs`` at distances (k,) [rad]."""
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
    air: Air,
    limb: Array = UNIFORM,
) -> Array:
    """(4,) fraction of the Sun's light in each band that passes the Earth and its atmosphere.

    Mean over the Sun's disc of the transmission along bent rays, 0 for rays that hit the ground. A
    part of the disc sends less light where refraction makes it look smaller: along a ray radiance
    stays. Arguments as for ``sunlit_shares``; the point may lie inside the atmosphere.
    """
    separation = angle_between(-position, sun_direction)
    distance = norm(position)
    # Heights are measured from the sphere through the ellipsoid's point below.
    below = distance / norm(position / radii)
    inside = distance - below < AIR_TOP
    if inside and separation > 0.5 * np.pi + _HIGH:
        cosine = np.array([-np.cos(separation)])
        depth = optical_depth_to_space(air, below, distance - below, cosine)[0]
        return band_transmittance(air, depth)
    if not inside and separation - sun_angular_radius > 0.5 * np.pi:
        return np.ones(4)
    # Radius of the sphere with the same limb angle.
    radius = distance * float(np.sin(limb_angle(position, sun_direction, radii)))
    low, high = separation - sun_angular_radius, separation + sun_angular_radius
    if not inside and distance * np.sin(max(low, 0.0)) - radius > AIR_TOP:
        return np.ones(4)
    if inside:
        rays = rays_from_inside(air, radius, distance - radius, low, high)
    else:
        rays = rays_from_space(air, radius, distance)
    if high <= rays.true.min():
        return np.zeros(4)
    return _past_bent_rays(rays, _light_up_to(sun_angular_radius, separation, limb))


def _past_bent_rays(rays: BentRays, light: Callable[[Array], Array]) -> Array:
    """(4,) share of a disc's light that reaches a place along bent rays.

    light : (k, 4) of the disc's light within angles (k,) from nadir

    Between two rays the disc's light between their true angles fills the cell between the apparent
    ones with the same radiance: by the cells' ratio more or less of it arrives.
    """
    everything = light(np.array([np.pi]))[0]
    shares = np.zeros(4)
    for band in range(4):
        seen, true, depth = rays.apparent[:, band], rays.true[:, band], rays.depth[:, band]
        up_to = light(true)[:, band]
        passed = np.exp(-0.5 * (depth[1:] + depth[:-1]))
        cells, ends = np.diff(np.cos(seen)), np.diff(np.cos(true))
        ratio = np.divide(cells, ends, out=np.zeros_like(cells), where=ends != 0.0)
        shares[band] = np.sum(ratio * passed * np.diff(up_to)) + everything[band] - up_to[-1]
    return np.maximum(shares, 0.0) / everything


def _light_up_to(disc_radius: float, separation: float, limb: Array) -> Callable[[Array], Array]:
    """A disc's light within circles about another centre, (k, 4) by their radii (k,).

    By arcs as in ``_arcs``, summed by Simpson's rule.
    """
    phi = np.linspace(0.0, np.pi, 257)
    width, theta = _arc_widths(disc_radius, separation, phi)
    profile = np.ones((1, 4))
    if limb.any():
        profile = _arc_profile(disc_radius, separation, theta, limb)
    slopes = (width * np.sin(phi))[:, None] * profile
    values = scipy.integrate.cumulative_simpson(slopes, x=phi, axis=0, initial=0.0)
    sums = scipy.interpolate.CubicHermiteSpline(phi, values, slopes)

    def light(radius: Array) -> Array:
        within = np.clip((separation - radius) / disc_radius, -1.0, 1.0)
        light_within: Array = sums(np.arccos(within))
        return light_within

    return light


def past_the_moon(
    point: Array,
    moon: Array,
    sun_direction: Array,
    sun_angular_radius: float,
    limb: Array = UNIFORM,
) -> Array:
    """(4,) fraction of the Sun's light in each band that passes the Moon.

    point, moon : (3,) positions in one frame [m]
    sun_direction : (3,) unit, towards the Sun from the point
    sun_angular_radius : [rad]
    limb : (2, 4) limb darkening of the Sun's disc
    """
    offset = moon - point
    distance = norm(offset)
    separation = angle_between(offset, sun_direction)
    moon_angular_radius = float(np.arcsin(MOON_RADIUS / distance))
    if separation >= sun_angular_radius + moon_angular_radius:
        return np.ones(4)
    return visible_light_fraction(sun_angular_radius, moon_angular_radius, separation, limb)
