"""Temperatures in the loop: they go on from a named state, and a replay gives the same bytes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from simgl_bridge import Client, ImageSet, RemoteError, Shot
from simgl_bridge.session_recording import SessionRecorder
from simgl_bridge.session_replay import replay_session, session_files

from simgl.scenario.loader import load_scenario
from tests.bridge.harness import SCENARIO, TURNING, Running
from tests.patience import limit

Starter = Callable[..., Running]
SECOND = 1_000_000_000
_INFRARED = """
[camera.infrared]
on = "chaser"
position_body_m = [0.0, 0.0, -0.2]
boresight = [0.0, 0.0, -1.0]
up = [0.0, 1.0, 0.0]
width_px = 64
height_px = 48
focal_length_mm = 5.0
thermal = { detector = "bolometer_lwir" }
[thermal]
patches = 60
"""
SHOTS = [
    Shot(camera="nav"),
    Shot(camera="infrared", products=("dn", "thermal_radiance", "temperature")),
]


@pytest.fixture
def running(start_server: Starter, tmp_path: Path) -> Running:
    """A server with a visible and a thermal camera, which records."""
    path = tmp_path / "thermal.toml"
    path.write_text(SCENARIO + _INFRARED)
    recorder = SessionRecorder(tmp_path / "records", with_images=True)
    return start_server(load_scenario(path), recorder=recorder)


def shadowed(client: Client, second: float, before: str = "", *, seek: bool = True) -> ImageSet:
    """Images of both cameras; from the first second on the Sun is behind the target."""
    # The scenario fixes its Sun by hand, of which a request gives the direction.
    sun = (1.0e11, 0.0, 1.2e11) if second < 1.0 else (-1.0e11, 0.0, -1.2e11)
    now = client.welcome.epoch_tai_ns + round(second * SECOND)
    return client.render_all(now, SHOTS, sun_position_m=sun, seek=seek, thermal_from=before)


def warmth(images: ImageSet) -> float:
    """Mean temperature of what the thermal camera sees of the target [K]."""
    kelvin = images["infrared"].planes["temperature"]
    return float(kelvin[kelvin > 0.0].mean())


def test_temperatures_go_on_from_a_named_state(running: Running) -> None:
    with Client(running.address, timeout_s=limit(60.0)) as client:
        start = shadowed(client, 0.0)
        assert start["infrared"].thermal_history == "steady"
        assert start["nav"].thermal_state == ""
        steady = shadowed(client, 61.0)
        after = shadowed(client, 61.0, start["infrared"].thermal_state)
        assert after["infrared"].thermal_history == "from the steady state"
        # In a minute the skin has lost some of its warmth, far from all.
        assert warmth(steady) < warmth(after) < warmth(start)
        assert after.state_hash != steady.state_hash


def test_other_clients_and_the_order_of_requests_change_nothing(running: Running) -> None:
    with (
        Client(running.address, timeout_s=limit(60.0)) as first,
        Client(running.address, timeout_s=limit(60.0)) as second,
    ):
        one, other = shadowed(first, 0.0), shadowed(second, 2.0)
        name = one["infrared"].thermal_state
        assert name != other["infrared"].thermal_state
        alone = shadowed(first, 30.0, name)
        # Meanwhile both ask for other branches, later and earlier.
        shadowed(second, 40.0, other["infrared"].thermal_state)
        shadowed(first, 50.0, alone["infrared"].thermal_state)
        again = shadowed(second, 30.0, name)
        assert again["infrared"].thermal_state == alone["infrared"].thermal_state
        for product, plane in alone["infrared"].planes.items():
            np.testing.assert_array_equal(again["infrared"].planes[product], plane)


def test_bad_states_are_refused_in_one_line(running: Running) -> None:
    with Client(running.address, timeout_s=limit(60.0)) as client:
        later = shadowed(client, 10.0)["infrared"].thermal_state
        with pytest.raises(RemoteError, match=r"thermal_from .*10 s later than tai_ns"):
            shadowed(client, 0.0, later)
        with pytest.raises(RemoteError, match=r"NO_THERMAL_STATE.*thermal_from .*not remembered"):
            shadowed(client, 0.0, "0" * 32)
        now = client.welcome.epoch_tai_ns
        with pytest.raises(RemoteError, match="requires a thermal camera"):
            client.render(now, "nav", seek=True, thermal_from=later)
        for camera, product in (("nav", "temperature"), ("infrared", "electrons")):
            with pytest.raises(RemoteError, match=rf"products.0. .*{camera}"):
                client.render(now, camera, products=(product,), seek=True)


def test_a_bolometer_lags_behind_a_chaser_that_turns(running: Running) -> None:
    # By 2 px a time constant; its thermal radiance is that of the epoch.
    with Client(running.address, timeout_s=limit(60.0)) as client:
        now = client.welcome.epoch_tai_ns
        still, moving, again = (
            client.render_all(now, SHOTS, {"chaser": TURNING}, seek=True, moving=turns)["infrared"]
            for turns in (False, True, True)
        )
    np.testing.assert_array_equal(moving.planes["dn"], again.planes["dn"])
    for product in ("thermal_radiance", "temperature"):
        np.testing.assert_array_equal(still.planes[product], moving.planes[product])
    # Noise is the same in both; a change of 1 K is some 70 DN.
    assert np.abs(moving.planes["dn"].astype(int) - still.planes["dn"]).max() > 700
    assert moving.exposure_end_tai_ns == now
    assert moving.exposure_start_tai_ns == now - 8_000_000


def test_a_replay_gives_the_same_bytes(running: Running, tmp_path: Path) -> None:
    with Client(running.address, timeout_s=limit(60.0)) as client:
        before = ""
        for second in (0.0, 5.0, 20.0):
            before = shadowed(client, second, before)["infrared"].thermal_state
    running.stop.set()
    running.thread.join(limit(20.0))
    (path,) = session_files(tmp_path / "records")
    assert replay_session(path).frames == 3
    assert replay_session(path).different == 0
    # The last one alone, too, whose temperatures come from those before.
    assert replay_session(path, every=2).different == 0
