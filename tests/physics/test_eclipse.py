"""Penumbra and limb against an independent quadrature, closed forms and limits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from simgl.arrays import Array
from simgl.physics.constants import WGS84_EQUATORIAL_RADIUS, WGS84_POLAR_RADIUS
from simgl.physics.eclipse import limb_angle, sunlit_shares, visible_disc_fraction
from simgl.physics.solar_disc import UNIFORM
from tests.authorities.eclipse import ALTITUDE, EARTH_RADIUS, FRACTIONS, SUN_HALF_ANGLE_DEG

WGS84 = np.array([WGS84_EQUATORIAL_RADIUS, WGS84_EQUATORIAL_RADIUS, WGS84_POLAR_RADIUS])
SPHERE = np.full(3, EARTH_RADIUS)
SUN = np.radians(SUN_HALF_ANGLE_DEG)
quick = settings(deadline=None, database=None, max_examples=100)


def direction(longitude: float, latitude: float) -> Array:
    """Unit vector of two angles [rad]."""
    c = np.cos(latitude)
    return np.array([c * np.cos(longitude), c * np.sin(longitude), np.sin(latitude)])


directions = st.builds(direction, st.floats(-np.pi, np.pi), st.floats(-1.5, 1.5))


def at_depression(beta: float) -> float:
    """Sunlit fraction at 400 km over the sphere, the Sun ``beta`` [rad] below the horizontal."""
    position = np.array([EARTH_RADIUS + ALTITUDE, 0.0, 0.0])
    sun = np.array([-np.sin(beta), np.cos(beta), 0.0])
    return float(sunlit_shares(position, sun, SUN, SPHERE, UNIFORM)[0])


@pytest.mark.parametrize(("beta_deg", "fraction"), FRACTIONS)
def test_the_disc_sinks_behind_a_sphere_as_in_the_table(beta_deg: float, fraction: float) -> None:
    # The table has five digits.
    assert abs(at_depression(np.radians(beta_deg)) - fraction) < 1e-5


@quick
@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_the_suns_light_falls_steadily_through_penumbra(one: float, other: float) -> None:
    first, last = np.radians(19.50), np.radians(20.10)
    a, b = sorted((first + (last - first) * one, first + (last - first) * other))
    more, less = at_depression(a), at_depression(b)
    # Rounding of the two arc sums.
    assert more >= less - 1e-12
    # No step: the limb sweeps at most the disc's diameter, 2 / (pi a) of the disc for each radian.
    assert more - less <= 2.0 / (np.pi * SUN) * (b - a) * 1.001 + 1e-12


@pytest.mark.parametrize("beta_deg", [-90.0, -20.0, 0.0, 19.0, 19.52])
def test_above_the_limb_the_whole_sun_is_seen(beta_deg: float) -> None:
    assert at_depression(np.radians(beta_deg)) == 1.0


@pytest.mark.parametrize("beta_deg", [20.06, 30.0, 60.0, 89.999, 90.0])
def test_in_umbra_nothing_is_seen(beta_deg: float) -> None:
    assert at_depression(np.radians(beta_deg)) == 0.0


def _visible_by_sampling(disc: float, body: float, separation: float) -> float:
    """The disc cut into 2000 rings about its own centre, each with its hidden arc."""
    edges = np.linspace(0.0, disc, 2001)
    r = 0.5 * (edges[1:] + edges[:-1])
    weight = np.cos(edges[:-1]) - np.cos(edges[1:])
    cosine = (np.cos(body) - np.cos(r) * np.cos(separation)) / (np.sin(r) * np.sin(separation))
    hidden = np.arccos(np.clip(cosine, -1.0, 1.0)) / np.pi
    return float(1.0 - np.sum(weight * hidden) / np.sum(weight))


@pytest.mark.parametrize(
    ("body", "separation"),
    [
        (0.5, 0.6),
        (0.5, 0.2),
        (0.9, 0.3),
        (1.1, 0.5),
        (1.5, 0.9),
        (2.0, 1.1),
        (3.0, 2.4),
        (250.0, 249.5),
        (250.0, 250.7),
    ],
)
def test_any_two_discs_overlap_as_ring_by_ring(body: float, separation: float) -> None:
    """Radii in units of the Sun's: deep space, where the Earth is smaller than the Sun, too."""
    ours = visible_disc_fraction(SUN, body * SUN, separation * SUN)
    # A ring that turns from hidden to seen within its width 1/2000 counts wrongly by as much, times
    # its share of the disc, 2/2000, and the square root at the ends of an arc: below 3e-5.
    assert abs(ours - _visible_by_sampling(SUN, body * SUN, separation * SUN)) < 3e-5


def test_a_small_body_before_the_disc_leaves_a_ring() -> None:
    # Annular eclipse: solid angles go with sin^2 of half the radius.
    expected = 1.0 - (np.sin(0.25 * SUN) / np.sin(0.5 * SUN)) ** 2
    for separation in (0.0, 1e-6, 0.3 * SUN, 0.5 * SUN):
        assert abs(visible_disc_fraction(SUN, 0.5 * SUN, separation) - expected) < 1e-9


def test_half_of_the_disc_is_seen_past_a_straight_edge() -> None:
    # A body of 90 deg is a half-space; its edge through the disc's centre halves the disc.
    fraction = visible_disc_fraction(SUN, 0.5 * np.pi, 0.5 * np.pi)
    assert abs(fraction - 0.5) < 1e-10


@quick
@given(directions, directions, st.floats(1e5, 4e7))
def test_the_limb_ray_touches_the_ellipsoid(place: Array, towards: Array, altitude: float) -> None:
    position = place * (WGS84_EQUATORIAL_RADIUS + altitude)
    assume(np.linalg.norm(np.cross(place, towards)) > 1e-3)
    angle = limb_angle(position, towards, WGS84)
    nadir = -place
    side = towards - np.dot(towards, nadir) * nadir
    ray = np.cos(angle) * nadir + np.sin(angle) * side / np.linalg.norm(side)
    # Where space is scaled to make the ellipsoid a unit sphere, a tangent passes its centre at 1.
    o, d = position / WGS84, ray / WGS84
    nearest = np.linalg.norm(np.cross(o, d)) / np.linalg.norm(d)
    # The tangent comes from a square root of a difference of numbers up to 50: 1e-12.
    assert abs(nearest - 1.0) < 1e-11
    assert 0.0 < angle < 0.5 * np.pi


def test_the_limb_of_a_sphere_lies_at_the_arc_sine() -> None:
    position = np.array([0.0, EARTH_RADIUS + ALTITUDE, 0.0])
    expected = np.arcsin(EARTH_RADIUS / (EARTH_RADIUS + ALTITUDE))
    for towards in np.eye(3):
        assert abs(limb_angle(position, towards, SPHERE) - expected) < 1e-14


def test_the_earths_limb_is_closer_to_nadir_towards_the_poles() -> None:
    # Over the equator: the limb seen along the equator is that of the circle; seen towards a pole
    # it is that of the meridian ellipse, whose tangent point has z = b sqrt(1 - (a/r)^2).
    a, b = WGS84_EQUATORIAL_RADIUS, WGS84_POLAR_RADIUS
    r = a + ALTITUDE
    position = np.array([r, 0.0, 0.0])
    along = limb_angle(position, np.array([0.0, 1.0, 0.0]), WGS84)
    across = limb_angle(position, np.array([0.0, 0.0, 1.0]), WGS84)
    assert abs(along - np.arcsin(a / r)) < 1e-14
    x, z = a * a / r, b * np.sqrt(1.0 - (a / r) ** 2)
    assert abs(across - np.arctan2(z, r - x)) < 1e-13
