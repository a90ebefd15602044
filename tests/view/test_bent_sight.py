"""Stars and discs through the air: where they are seen, how flat, and how much light is left."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from simgl.arrays import Array
from simgl.physics.air_profile import AIR_TOP
from simgl.physics.atmosphere import SOURCE, STANDARD, Atmosphere
from simgl.physics.eclipse import sunlit_transmission
from simgl.physics.frames import angle_between
from simgl.scene.earth import Earth
from simgl.view.bent_sight import BentSight

RADIUS = 6.371e6
SUN = np.radians(0.263)
NOTHING = (0.0, 0.0, 0.0, 0.0)
CLEAR = replace(STANDARD, rayleigh=NOTHING, aerosol=NOTHING, ozone=NOTHING)


def sight(height: float, air: Atmosphere = STANDARD) -> BentSight | None:
    """From a place over the equator of a sphere."""
    earth = SimpleNamespace(
        earth=Earth(equatorial_radius=RADIUS, polar_radius=RADIUS, air=air),
        position=np.zeros(3),
        R_itrf_from_icrf=np.eye(3),
    )
    state = SimpleNamespace(earth=earth)
    return BentSight.at(state, np.array([RADIUS + height, 0.0, 0.0]))  # type: ignore[arg-type]


def towards(from_nadir: float) -> Array:
    return np.array([-np.cos(from_nadir), 0.6 * np.sin(from_nadir), 0.8 * np.sin(from_nadir)])


def passing(height: float) -> Array:
    """From 400 km, along a straight ray with this lowest height."""
    return towards(float(np.arcsin((RADIUS + height) / (RADIUS + 400e3))))


def test_a_star_5_km_high_is_lifted_by_a_quarter_of_a_degree_straight_up() -> None:
    bent = sight(400e3)
    assert bent is not None
    true = np.stack([passing(5e3), passing(AIR_TOP + 1e3), towards(2.5)])
    seen, shares = bent.points(true)
    assert np.degrees(angle_between(true[0], seen[0])) == pytest.approx(0.24, abs=0.005)
    assert seen[0, 2] / seen[0, 1] == pytest.approx(0.8 / 0.6)
    assert np.linalg.norm(seen[0]) == pytest.approx(1.0)
    # Light of a star at its rising is spread over as much more of the orbit.
    assert 0.2 < shares[0] < 0.6
    np.testing.assert_array_equal(seen[1:], true[1:])
    np.testing.assert_array_equal(shares[1:], 1.0)


def test_the_air_of_the_source_bends_nothing() -> None:
    assert sight(400e3, SOURCE) is None


@pytest.mark.parametrize("height", [16e3, 24e3, 40e3])
def test_the_suns_flat_disc_has_the_light_that_a_spacecraft_receives(height: float) -> None:
    """In clear air, with radiance that stays: by its solid angle."""
    bent = sight(400e3, CLEAR)
    assert bent is not None
    sun = passing(height)
    disc = bent.disc(sun, SUN)
    place = np.array([RADIUS + 400e3, 0.0, 0.0])
    share = sunlit_transmission(place, sun, SUN, np.full(3, RADIUS), CLEAR)[1]
    # The ellipse has the disc's height and width, not its shape: 6 %.
    assert np.prod(disc.half_angles) / SUN**2 == pytest.approx(share, rel=0.06)
    assert disc.half_angles[0] == pytest.approx(SUN, rel=0.01)


def test_an_observer_on_the_ground_sees_the_setting_sun_flattened_to_five_sixths() -> None:
    bent = sight(2.0)
    assert bent is not None
    # The lower limb on the horizon is lifted by 33.5', the upper one by 28.
    disc = bent.disc(towards(np.radians(90.0 - 0.56 + 0.263)), SUN)
    assert disc.half_angles[1] / SUN == pytest.approx(5.0 / 6.0, abs=0.03)
    lower = angle_between(disc.direction, towards(0.0)) - disc.half_angles[1]
    assert np.degrees(lower) == pytest.approx(90.0, abs=0.05)
