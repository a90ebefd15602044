"""A spot light as numbers: where its watts go."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.arrays import Array
from simgl.physics.frames import Pose, rotation_between
from simgl.scene.lamps import (
    Lamp,
    LampState,
    beam_profile,
    beam_solid_angle,
    lamp_state,
)
from tests.reference.lamps import point_irradiance

POWER = np.array([1.0, 2.0, 3.0, 4.0])


def lamp(half_angle_deg: float = 20.0, edge_deg: float = 2.0) -> LampState:
    given = Lamp(
        name="spot",
        spacecraft="chaser",
        position_body=np.zeros(3),
        boresight_body=np.array([0.0, 0.0, 1.0]),
        look_at=None,
        power=POWER,
        half_angle=np.radians(half_angle_deg),
        edge=np.radians(edge_deg),
        radius=0.02,
    )
    return LampState(
        lamp=given, position=np.array([1.0, 2.0, 3.0]), direction=np.array([0.0, 0.0, 1.0])
    )


def at(angle_deg: float, distance: float, towards: bool = True) -> tuple[Array, Array]:
    """A surface element off the axis by an angle, facing the lamp."""
    a = np.radians(angle_deg)
    out = np.array([[np.sin(a), 0.0, np.cos(a)]])
    return lamp().position + distance * out, -out if towards else out


@pytest.mark.parametrize("half_angle_deg", [0.5, 10.0, 45.0, 70.0])
@pytest.mark.parametrize("edge_deg", [0.01, 2.0, 5.0])
def test_what_passes_a_sphere_around_the_lamp_is_its_power(
    half_angle_deg: float, edge_deg: float
) -> None:
    spot = lamp(half_angle_deg, edge_deg)
    nodes, weights = np.polynomial.legendre.leggauss(64)
    total = np.zeros(4)
    for low, high in ((0.0, half_angle_deg), (half_angle_deg, half_angle_deg + edge_deg)):
        angle = np.radians(low + 0.5 * (high - low) * (nodes + 1.0))
        out = np.stack([np.sin(angle), 0.0 * angle, np.cos(angle)], axis=1)
        ring = 2.0 * np.pi * np.sin(angle) * np.radians(0.5 * (high - low)) * weights
        total += 49.0 * ring @ point_irradiance(spot, spot.position + 7.0 * out, -out)
    # An edge of 0.01 deg goes from a cosine of seven digits to the next.
    np.testing.assert_allclose(total, POWER, rtol=1e-8)


def test_irradiance_falls_with_the_distance_squared() -> None:
    near, far = (point_irradiance(lamp(), *at(15.0, r)) for r in (2.0, 20.0))
    np.testing.assert_allclose(near, 100.0 * far, rtol=1e-12)
    np.testing.assert_allclose(near[0] * 4.0, lamp().lamp.intensity, rtol=1e-12)


def test_irradiance_goes_with_the_cosine_and_ends_behind_the_surface() -> None:
    point, facing = at(0.0, 5.0)
    full = point_irradiance(lamp(), point, facing)
    for tilt in (30.0, 60.0, 89.0, 91.0, 180.0):
        t = np.radians(tilt)
        normal = np.array([[np.sin(t), 0.0, -np.cos(t)]])
        expected = full * max(np.cos(t), 0.0)
        np.testing.assert_allclose(point_irradiance(lamp(), point, normal), expected, atol=1e-15)


def test_the_cone_ends_in_half_a_cosine() -> None:
    for angle, share in ((0.0, 1.0), (20.0, 1.0), (20.5, 0.5 + 0.5**1.5), (21.0, 0.5), (22.0, 0.0)):
        got = point_irradiance(lamp(), *at(angle, 5.0))
        np.testing.assert_allclose(got[0], share * lamp().lamp.intensity / 25.0, atol=1e-12)
    assert not point_irradiance(lamp(), *at(180.0, 5.0)).any()
    assert beam_profile(np.array(0.3), 0.2, 0.05) == 0.0


def test_a_sharp_cone_has_the_solid_angle_of_a_cap() -> None:
    cap = 2.0 * np.pi * (1.0 - np.cos(0.4))
    # The edge adds half its width at first order: 2 pi sin(0.4) x 0.5e-4.
    assert abs(beam_solid_angle(0.4, 1e-4) - cap - np.pi * np.sin(0.4) * 1e-4) < 1e-8


def test_a_lamp_moves_and_turns_with_its_carrier_and_follows_a_target() -> None:
    R = rotation_between([0.0, 0.0, 1.0], [1.0, 1.0, 0.0])
    carrier = Pose(position=np.array([7e6, 0.0, 0.0]), velocity=np.zeros(3), R_icrf_from_body=R)
    target = Pose(
        position=np.array([7e6, 0.0, 30.0]), velocity=np.zeros(3), R_icrf_from_body=np.eye(3)
    )
    bodies = {"chaser": carrier, "target": target}
    fixed = lamp_state(lamp().lamp, bodies)
    np.testing.assert_allclose(
        fixed.direction, np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0), atol=1e-15
    )
    own = fixed.seen_from_body(carrier)
    np.testing.assert_allclose(own.position, 0.0, atol=1e-9)
    np.testing.assert_allclose(own.direction, [0.0, 0.0, 1.0], atol=1e-15)
    seen = fixed.seen_from_body(target)
    np.testing.assert_allclose(seen.position, [0.0, 0.0, -30.0], atol=1e-9)
