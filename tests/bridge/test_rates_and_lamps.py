"""What a request may say of an exposure: bodies that move meanwhile, lamps that are dimmed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from simgl_bridge import BodyPose, Client, RemoteError
from simgl_bridge.hashes import state_hash
from simgl_bridge.message_parts import SentPose

from simgl import Scenario, load_scenario
from simgl.arrays import Array
from tests.bridge.harness import LIT_SCENARIO, Running

Starter = Callable[..., Running]

CHASER = BodyPose(
    position_m=(0.0, 0.0, 40.0),
    velocity_m_s=(0.0, 0.0, 0.0),
    q_icrf_from_body_xyzw=(0.0, 0.0, 0.0, 1.0),
)
# A picture's blur is sought in electrons, which have no noise.
EXPOSURE = 0.1


def target(
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0),
    turning: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> BodyPose:
    """The target at the origin with its rates."""
    return BodyPose(
        position_m=(0.0, 0.0, 0.0),
        velocity_m_s=velocity,
        q_icrf_from_body_xyzw=(0.0, 0.0, 0.0, 1.0),
        angular_velocity_rad_s=turning,
    )


def electrons(client: Client, body: BodyPose, *, moving: bool) -> Array:
    """(height, width) of what the camera collects."""
    image = client.render(
        client.welcome.epoch_tai_ns,
        "nav",
        {"chaser": CHASER, "target": body},
        exposure_time_s=EXPOSURE,
        products=("electrons",),
        moving=moving,
        seek=True,
    )
    return np.asarray(image.planes["electrons"], dtype=np.float64)


def variance(picture: Array, axis: int) -> float:
    """Of where the light lies along an axis of the picture [px^2]."""
    light = picture.sum(axis=1 - axis)
    places = np.arange(len(light)) + 0.5
    mean = float(light @ places / light.sum())
    return float(light @ (places - mean) ** 2 / light.sum())


def test_a_target_that_crosses_the_view_is_smeared_by_its_way(client: Client) -> None:
    still = electrons(client, target(), moving=False)
    # 5 m/s for 0.1 s is 0.5 m; its face is 39.3 m from the pinhole, the focal length 533.3 px.
    smeared = electrons(client, target(velocity=(5.0, 0.0, 0.0)), moving=True)
    way = 0.5 / 39.3 * 533.3
    assert smeared.sum() == pytest.approx(still.sum(), rel=0.01)
    # A way crossed at a steady speed adds the variance of a uniform distribution, which the moments
    # that are drawn have too; samples are 0.2 px apart.
    added = variance(smeared, 1) - variance(still, 1)
    assert added == pytest.approx(way**2 / 12.0, rel=0.03)
    assert abs(variance(smeared, 0) - variance(still, 0)) < 0.05


def test_a_target_that_turns_is_smeared_about_its_middle(client: Client) -> None:
    still = electrons(client, target(), moving=False)
    # A face of 2 m x 1 m (a, b) seen along its axis: over a turn by an angle t its variance along
    # the long side falls from a^2/12 to the mean of (a^2 cos^2 + b^2 sin^2)/12.
    angle = 1.5 * EXPOSURE * 5.0
    turned = electrons(client, target(turning=(0.0, 0.0, angle / EXPOSURE)), moving=True)
    sine2 = 0.5 - 0.5 * np.sin(angle) / angle
    scale = (533.3 / 39.3) ** 2 / 12.0
    added = variance(turned, 0) - variance(still, 0)
    assert added == pytest.approx(scale * 3.0 * sine2, rel=0.03)


def test_rates_without_moving_change_nothing_in_the_picture(client: Client) -> None:
    still = electrons(client, target(), moving=False)
    rates = electrons(client, target((5.0, 0.0, 0.0), (0.0, 0.0, 1.0)), moving=False)
    np.testing.assert_array_equal(rates, still)


@pytest.fixture
def lit(start_server: Starter, tmp_path: Path) -> Running:
    """The small scene with a lamp."""
    path = tmp_path / "lit.toml"
    path.write_text(LIT_SCENARIO)
    return start_server(load_scenario(path))


def radiance(client: Client, lamps: dict[str, float] | None) -> Array:
    """Of the target by what is left of the lamp, and the Sun."""
    image = client.render(
        client.welcome.epoch_tai_ns,
        "nav",
        {"chaser": CHASER},
        products=("radiance",),
        lamps=lamps,
        seek=True,
    )
    return np.asarray(image.planes["radiance"], dtype=np.float64)


def test_a_lamp_burns_with_the_share_that_is_sent(lit: Running) -> None:
    with Client(lit.address) as client:
        assert client.welcome.lamps == ("flood",)
        full, off = radiance(client, None), radiance(client, {"flood": 0.0})
        quarter = radiance(client, {"flood": 0.25})
        np.testing.assert_array_equal(radiance(client, {"flood": 1.0}), full)
    gain = full - off
    assert gain.max() > 0.1
    # Light adds up; float32 of a radiance of 200 W m-2 sr-1 is good to 1e-5.
    np.testing.assert_allclose(quarter - off, 0.25 * gain, atol=1e-4)


@pytest.mark.parametrize(
    ("lamps", "code", "detail"),
    [
        ({"flod": 1.0}, "NO_LAMP", 'lamps "flod" does not exist here; did you mean "flood"?'),
        ({"flood": 1.5}, "BAD_VALUE", "lamps.flood must lie in 0..1, got 1.5"),
        ({"flood": float("nan")}, "BAD_VALUE", "lamps.flood must lie in 0..1, got nan"),
    ],
)
def test_a_wrong_lamp_is_named(
    lit: Running, lamps: dict[str, float], code: str, detail: str
) -> None:
    with Client(lit.address) as client, pytest.raises(RemoteError) as caught:
        radiance(client, lamps)
    assert caught.value.code == code
    assert detail in str(caught.value)


def test_a_turn_that_no_body_can_make_is_named(client: Client) -> None:
    with pytest.raises(RemoteError, match=r"bodies.target.angular_velocity_rad_s must be at most"):
        electrons(client, target(turning=(0.0, 0.0, 101.0)), moving=True)


def test_the_state_hash_knows_lamps_and_rates_only_where_they_count() -> None:
    pose = SentPose(
        position_m=(1.0, 2.0, 3.0),
        velocity_m_s=(0.0, -0.5, 0.0),
        q_icrf_from_body_xyzw=(0.0, 0.0, 0.0, 1.0),
    )
    turning = SentPose(
        position_m=(1.0, 2.0, 3.0),
        velocity_m_s=(0.0, -0.5, 0.0),
        q_icrf_from_body_xyzw=(0.0, 0.0, 0.0, 1.0),
        angular_velocity_rad_s=(0.0, 0.0, 0.1),
    )
    state: dict[str, Any] = {"tai_ns": 1, "sun": None, "cameras": [("a", 1.0, 2.0)], "seed": 0}
    plain = state_hash(bodies={"x": pose}, **state)
    assert plain == state_hash(bodies={"x": turning}, **state)
    moving = state_hash(bodies={"x": pose}, moving=True, **state)
    others = {
        plain,
        moving,
        state_hash(bodies={"x": turning}, moving=True, **state),
        state_hash(bodies={"x": pose}, lamps={"l": 0.5}, **state),
        state_hash(bodies={"x": pose}, lamps={"l": 0.25}, **state),
        state_hash(bodies={"x": pose}, lamps={"m": 0.5}, **state),
        state_hash(bodies={"x": pose}, lamps={"l": 0.5}, moving=True, **state),
        state_hash(bodies={"x": pose}, draw=1, **state),
        state_hash(bodies={"x": pose}, draw=2, **state),
        state_hash(bodies={"x": pose}, draw=1, moving=True, **state),
    }
    assert len(others) == 10


def test_a_scene_without_lamps_offers_none(client: Client, scenario: Scenario) -> None:
    assert not scenario.lamps
    assert client.welcome.lamps == ()
