"""Where cameras stand and look: each law checked by hand, in LVLH, ICRF and body axes."""

from __future__ import annotations

import erfa
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simgl.arrays import Array
from simgl.errors import ConfigError
from simgl.motion.mounts import BodyMount, FreeMount, Mount, OrbitingMount, camera_pose
from simgl.motion.orbits import KeplerianOrbit
from simgl.motion.pointing import Axes, Limb, Place, Pointing
from simgl.physics.frames import Pose, lvlh_from_icrf, unit
from simgl.scene.earth import Earth
from simgl.scene.state import EarthState

RADIUS = 6.778137e6
X, Y, Z = np.eye(3)
# On +x, flying along +y: LVLH x is +y, y is -z, z is -x in ICRF.
R_ICRF_FROM_LVLH = np.column_stack([Y, -Z, -X])
# Differences of places of 7e6 m: one unit of their last digit is 1e-9 m.
FAR = 5e-9
EARTH = EarthState(earth=Earth(), position=np.zeros(3), R_itrf_from_icrf=np.eye(3))


def towards_sun(_: Array) -> Array:
    """The Sun in one direction from everywhere."""
    return Y


quick = settings(deadline=None, database=None, max_examples=60)


def on_target(pointing: Pointing, spacecraft: str = "target") -> BodyMount:
    """A camera at a spacecraft's origin."""
    return BodyMount(spacecraft=spacecraft, position_body=np.zeros(3), pointing=pointing)


def at_target(place: Array) -> Pointing:
    """Keeps a place on the target in the centre."""
    towards = Place(spacecraft="target", position_body=place)
    return Pointing(towards=towards, axes="icrf", up=X)


def limb(azimuth: float, tangent_height: float) -> Pointing:
    """Looks at the limb, the zenith up."""
    towards = Limb(azimuth=azimuth, tangent_height=tangent_height)
    return Pointing(towards=towards, axes="lvlh", up=-Z)


BODIES = {
    "target": Pose(
        position=RADIUS * X, velocity=7.6e3 * Y, R_icrf_from_body=np.column_stack([Y, Z, X])
    )
}


@pytest.mark.parametrize(
    ("azimuth", "elevation", "place_lvlh"),
    [
        (0.0, 0.0, [-30.0, 0.0, 0.0]),  # behind
        (90.0, 0.0, [0.0, 0.0, -30.0]),  # above
        (180.0, 0.0, [30.0, 0.0, 0.0]),  # ahead
        (-90.0, 0.0, [0.0, 0.0, 30.0]),  # below
        (0.0, 30.0, [-30.0 * np.sqrt(0.75), -15.0, 0.0]),  # towards the orbit normal
    ],
)
def test_an_orbiting_camera_stands_where_azimuth_and_elevation_say(
    azimuth: float, elevation: float, place_lvlh: list[float]
) -> None:
    mount = OrbitingMount(
        target="target", azimuth=np.radians(azimuth), elevation=np.radians(elevation), range=30.0
    )
    position, R_camera_from_icrf = camera_pose("cam", mount, BODIES)
    offset = position - BODIES["target"].position
    np.testing.assert_allclose(R_ICRF_FROM_LVLH.T @ offset, place_lvlh, rtol=0.0, atol=FAR)
    # The target is on the boresight at the range.
    np.testing.assert_allclose(
        R_camera_from_icrf @ -offset, [0.0, 0.0, 30.0], rtol=0.0, atol=2 * FAR
    )


def test_an_orbiting_camera_behind_the_target_has_the_zenith_up_and_the_normal_left() -> None:
    mount = OrbitingMount(target="target", azimuth=0.0, elevation=0.0, range=30.0)
    _, R_camera_from_icrf = camera_pose("cam", mount, BODIES)
    np.testing.assert_allclose(
        R_camera_from_icrf @ X, [0.0, -1.0, 0.0], rtol=0.0, atol=1e-14
    )  # zenith
    # Looking along the velocity with the zenith up, the orbit normal points to the left.
    np.testing.assert_allclose(R_camera_from_icrf @ Z, [-1.0, 0.0, 0.0], rtol=0.0, atol=1e-14)


@quick
@given(st.floats(-7.0, 7.0), st.floats(-1.5, 1.5), st.floats(0.5, 1e5))
def test_an_orbiting_camera_keeps_range_and_target_at_every_angle(
    azimuth: float, elevation: float, distance: float
) -> None:
    mount = OrbitingMount(target="target", azimuth=azimuth, elevation=elevation, range=distance)
    position, R_camera_from_icrf = camera_pose("cam", mount, BODIES)
    line = R_camera_from_icrf @ (BODIES["target"].position - position)
    np.testing.assert_allclose(line, [0.0, 0.0, distance], rtol=0.0, atol=2 * FAR)
    np.testing.assert_allclose(
        R_camera_from_icrf @ R_camera_from_icrf.T, np.eye(3), rtol=0.0, atol=1e-14
    )


def test_a_body_mounted_camera_rides_on_its_body() -> None:
    mount = BodyMount(
        spacecraft="target",
        position_body=np.array([1.0, 2.0, 3.0]),
        pointing=Pointing(towards=X, axes="body", up=-Z),
    )
    position, R_camera_from_icrf = camera_pose("cam", mount, BODIES)
    # Body x, y, z are ICRF y, z, x here.
    np.testing.assert_allclose(position, [RADIUS + 3.0, 1.0, 2.0], rtol=0.0, atol=FAR)
    np.testing.assert_allclose(R_camera_from_icrf @ Y, [0.0, 0.0, 1.0], rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(R_camera_from_icrf @ -X, [0.0, -1.0, 0.0], rtol=0.0, atol=1e-15)


def test_a_free_camera_that_looks_at_a_body_has_it_on_the_boresight() -> None:
    mount = FreeMount(position=np.array([RADIUS, -40.0, 30.0]), pointing=at_target(np.zeros(3)))
    position, R_camera_from_icrf = camera_pose("cam", mount, BODIES)
    np.testing.assert_allclose(
        R_camera_from_icrf @ (BODIES["target"].position - position),
        [0.0, 0.0, 50.0],
        rtol=0.0,
        atol=FAR,
    )


@pytest.mark.parametrize(
    ("mount", "message"),
    [
        (
            FreeMount(position=RADIUS * X, pointing=at_target(np.zeros(3))),
            '[camera.cam]: look_at cannot look at "target", whose origin is at the pinhole',
        ),
        (
            FreeMount(position=RADIUS * X + Y, pointing=at_target(X)),
            '[camera.cam]: look_at cannot look at "target", whose place there is at the pinhole',
        ),
        (
            on_target(Pointing(towards=Z, axes="lvlh", up=X), "still"),
            '[camera.cam]: axes needs LVLH axes, which "still" lacks: '
            "it does not move about the Earth",
        ),
        (
            on_target(limb(0.0, 5e5)),
            "[camera.cam]: limb.tangent_height_km must lie below the camera",
        ),
        (
            OrbitingMount(target="still", azimuth=0.0, elevation=0.0, range=1.0),
            '[camera.cam]: about needs LVLH axes, which "still" lacks: '
            "it does not move about the Earth",
        ),
    ],
)
def test_a_camera_without_a_direction_is_refused(mount: Mount, message: str) -> None:
    still = Pose(position=RADIUS * X, velocity=np.zeros(3), R_icrf_from_body=np.eye(3))
    with pytest.raises(ConfigError) as caught:
        camera_pose("cam", mount, {**BODIES, "still": still}, towards_sun, EARTH)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("law", "boresight", "top"),
    [
        (Pointing(towards=Z, axes="lvlh", up=X), -X, Y),  # nadir, ahead at the top
        (Pointing(towards=X, axes="lvlh", up=-Z), Y, X),  # along the velocity, zenith up
        (Pointing(towards=-Y, axes="lvlh", up=X), Z, Y),  # along the orbit normal
        (Pointing(towards=Z, axes="icrf", up=X), Z, X),  # fixed among the stars
        (Pointing(towards=Z, axes="body", up=X), X, Y),  # body x, y, z are ICRF y, z, x here
    ],
)
def test_a_direction_is_along_its_axes(law: Pointing, boresight: Array, top: Array) -> None:
    _, R_camera_from_icrf = camera_pose("cam", on_target(law), BODIES)
    np.testing.assert_allclose(R_camera_from_icrf[2], boresight, rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(R_camera_from_icrf[1], -top, rtol=0.0, atol=1e-15)


@pytest.mark.parametrize("axes", ["body", "lvlh", "icrf"])
def test_a_place_on_a_spacecraft_is_kept_in_the_centre(axes: Axes) -> None:
    towards = Place(spacecraft="target", position_body=np.array([1.0, 2.0, 3.0]))
    seen_from = np.array([0.0, -8.0, 4.0])
    mount = BodyMount(
        spacecraft="target",
        position_body=seen_from,
        pointing=Pointing(towards=towards, axes=axes, up=-Z),
    )
    position, R_camera_from_icrf = camera_pose("cam", mount, BODIES)
    # Body x, y, z are ICRF y, z, x here.
    place = BODIES["target"].position + np.array([3.0, 1.0, 2.0])
    distance = float(np.linalg.norm(towards.position_body - seen_from))
    actual = R_camera_from_icrf @ (place - position)
    np.testing.assert_allclose(actual, [0.0, 0.0, distance], rtol=0.0, atol=2 * FAR)


def lowest_height(position: Array, direction: Array) -> float:
    """Over WGS84, of a sight line, by looking at it in ever finer steps [m]."""
    middle, span = float(-position @ direction), 2e5
    for _ in range(6):
        along = np.linspace(middle - span, middle + span, 201)
        heights = erfa.gc2gd(1, position + along[:, None] * direction)[2]
        middle, span = float(along[np.argmin(heights)]), span / 50.0
    return float(np.min(heights))


angles = st.floats(-3.1, 3.1)


@quick
@given(angles, angles, angles, angles, st.floats(0.0, 1e5))
def test_a_sight_line_to_the_limb_passes_at_the_tangent_height(
    inclination: float, raan: float, anomaly: float, azimuth: float, height: float
) -> None:
    orbit = KeplerianOrbit(
        semi_major_axis=RADIUS,
        eccentricity=0.0,
        inclination=inclination,
        raan=raan,
        argument_of_perigee=0.0,
        true_anomaly=anomaly,
        epoch_tai_ns=0,
    )
    position, velocity = orbit.state(0)
    pose = Pose(position=position, velocity=velocity, R_icrf_from_body=np.eye(3))
    mount = on_target(limb(azimuth, height))
    _, R_camera_from_icrf = camera_pose("cam", mount, {"target": pose}, towards_sun, EARTH)
    boresight = R_camera_from_icrf[2]
    # An ellipsoid whose radii are larger by h is h away from the other but for h f^2, 1.1 m at
    # 100 km; the steps end at 2e5 / 50^5 m, where the height is off by far less.
    assert lowest_height(position, boresight) == pytest.approx(height, abs=1.5)
    ahead, right, _ = lvlh_from_icrf(position, velocity) @ boresight
    assert np.arctan2(right, ahead) == pytest.approx(azimuth, abs=1e-12)
    # The sight line leads down, and the top of the picture is towards the zenith.
    assert boresight @ position < 0.0
    assert R_camera_from_icrf[1] @ position < 0.0


directions = st.tuples(angles, angles, angles).map(np.array).filter(lambda v: v @ v > 1e-6)


@quick
@given(directions, directions, st.floats(0.01, 3.1))
def test_a_camera_keeps_from_the_sun_and_turns_no_further_than_it_must(
    wanted: Array, sun: Array, least: float
) -> None:
    wanted, sun = unit(wanted), unit(sun)
    law = Pointing(towards=wanted, axes="icrf", up=X, sun_exclusion=least)
    _, R_camera_from_icrf = camera_pose("cam", on_target(law), BODIES, lambda _: sun)
    actual = R_camera_from_icrf[2]

    def apart(a: Array, b: Array) -> float:
        return float(2.0 * np.arctan2(np.linalg.norm(a - b), np.linalg.norm(a + b)))

    # Angles of unit vectors are good to 1e-15 each; near the Sun the plane is known to 1e-9.
    if apart(wanted, sun) >= least:
        assert apart(actual, wanted) < 1e-14
    else:
        assert apart(actual, sun) == pytest.approx(least, abs=1e-8)
        assert apart(actual, wanted) == pytest.approx(least - apart(wanted, sun), abs=1e-8)


def test_a_camera_that_looks_into_the_sun_turns_towards_its_top() -> None:
    law = Pointing(towards=Y, axes="icrf", up=Z, sun_exclusion=np.radians(30.0))
    _, R_camera_from_icrf = camera_pose("cam", on_target(law), BODIES, towards_sun)
    expected = [0.0, np.sqrt(0.75), 0.5]
    np.testing.assert_allclose(R_camera_from_icrf[2], expected, rtol=0.0, atol=1e-15)
