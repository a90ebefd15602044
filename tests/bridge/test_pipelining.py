"""Two requests under way: the same images in order, and errors that stay with their request."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from simgl_bridge import Client, NoAnswerError, RemoteError, Shot, launched_server

from simgl import Scenario
from simgl.errors import BridgeError
from tests.bridge.harness import Gate, Running
from tests.patience import limit

Starter = Callable[..., Running]
NAV = [Shot(camera="nav")]


def test_images_are_those_of_one_request_after_the_other(
    client: Client, scenario: Scenario
) -> None:
    times = [scenario.epoch_tai_ns + i * 10**8 for i in range(6)]
    pending = [client.submit(when, NAV) for when in times]
    ahead = [one.result() for one in pending]
    serial = [client.render_all(when, NAV, seek=True) for when in times]
    for when, one, other in zip(times, ahead, serial, strict=True):
        assert one["nav"].tai_ns == when
        assert one["nav"].state_hash == other["nav"].state_hash
        np.testing.assert_array_equal(one["nav"].dn, other["nav"].dn)
    assert [one.sequence for one in ahead] == sorted(one.sequence for one in ahead)


def test_results_may_be_taken_in_any_order_and_again(client: Client, scenario: Scenario) -> None:
    now = scenario.epoch_tai_ns
    first, second = client.submit(now, NAV), client.submit(now + 1, NAV)
    assert second.result()["nav"].tai_ns == now + 1
    assert first.done
    assert first.result()["nav"].tai_ns == now
    assert first.result() is first.result()


def test_the_second_waits_at_the_server_while_the_first_is_drawn(
    start_server: Starter, scenario: Scenario
) -> None:
    running, gate, now = start_server(scenario), Gate(), scenario.epoch_tai_ns
    running.simulator.hook = gate
    with Client(running.address, timeout_s=limit(60.0)) as client:
        first, second = client.submit(now, NAV), client.submit(now + 1, NAV)
        gate.wait()
        deadline = time.monotonic() + limit(20.0)
        while client.stats().waiting < 1 and time.monotonic() < deadline:
            time.sleep(0.01)
        assert client.stats().waiting == 1
        assert not first.done
        assert not second.done
        gate.open()
        # A third one, and one that waits, find room although two are under way.
        third = client.submit(now + 2, NAV)
        assert client.render(now + 3, "nav").tai_ns == now + 3
        tai_ns = [one.result()["nav"].tai_ns for one in (first, second, third)]
        assert tai_ns == [now, now + 1, now + 2]


@pytest.mark.parametrize("wrong", [0, 1])
def test_an_error_stays_with_its_request(client: Client, scenario: Scenario, wrong: int) -> None:
    now = scenario.epoch_tai_ns
    cameras = [NAV, NAV]
    cameras[wrong] = [Shot(camera="nav", exposure_time_s=1e9)]
    pending = [client.submit(now + i, shots) for i, shots in enumerate(cameras)]
    assert pending[1 - wrong].result()["nav"].tai_ns == now + 1 - wrong
    for _ in range(2):
        with pytest.raises(RemoteError, match="exposure_time_s"):
            pending[wrong].result()


def test_time_may_not_run_backwards_between_them(client: Client, scenario: Scenario) -> None:
    now = scenario.epoch_tai_ns
    first, second = client.submit(now + 1, NAV), client.submit(now, NAV)
    assert first.result()["nav"].tai_ns == now + 1
    with pytest.raises(RemoteError, match="must not be before"):
        second.result()
    assert client.submit(now, NAV, seek=True).result()["nav"].tai_ns == now


def test_a_server_that_is_killed_fails_each_with_one_line(
    scenario_path: Path, scenario: Scenario
) -> None:
    now = scenario.epoch_tai_ns
    with (
        launched_server(scenario_path) as (process, address),
        Client(address, timeout_s=limit(60.0)) as client,
    ):
        client.render(now, "nav")
        # Frozen first, so that no answer is faster.
        process.send_signal(signal.SIGSTOP)
        pending = [client.submit(now + i, NAV) for i in range(2)]
        process.kill()
        for one in pending:
            with pytest.raises(NoAnswerError, match="the connection broke") as caught:
                one.result()
            assert "\n" not in str(caught.value)


def test_what_arrived_in_time_counts_however_late_it_is_read(
    running: Running, scenario: Scenario
) -> None:
    timeout_s = limit(2.0)
    with Client(running.address, timeout_s=timeout_s) as client:
        pending = client.submit(scenario.epoch_tai_ns, NAV)
        time.sleep(1.1 * timeout_s)
        assert pending.result()["nav"].tai_ns == scenario.epoch_tai_ns


def test_a_closed_client_says_so(running: Running, scenario: Scenario) -> None:
    with Client(running.address, timeout_s=limit(20.0)) as client:
        pending = client.submit(scenario.epoch_tai_ns, NAV)
    with pytest.raises(BridgeError, match="this client is closed"):
        pending.result()
