"""Free-run: the newest state at the server's own rate; previews that may be dropped."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import pytest
from simgl_bridge import Client, PreviewClient, RemoteError, Shot
from simgl_bridge.free_run import StateStream
from simgl_bridge.messages import State
from simgl_bridge.preview import PreviewImage

from simgl import Scenario
from tests.bridge.harness import Gate, RawLink, Running
from tests.patience import limit

Starter = Callable[..., Running]
NAV = [Shot(camera="nav")]


def test_the_newest_state_is_shown_and_the_picture_says_which_it_is(
    start_server: Starter, scenario: Scenario
) -> None:
    running = start_server(scenario)
    now = scenario.epoch_tai_ns
    with Client(running.address, timeout_s=limit(10.0)) as client:
        running.simulator.hook = gate = Gate()
        first = client.send_state(now, NAV)
        gate.wait()
        # While the first is rendered, nine more come by; only the last of them is shown.
        ids = [client.send_state(now + step, NAV) for step in range(1, 10)]
        gate.open()
        tick = client.next_images()
        assert (tick.state_id, tick.dropped, tick.tai_ns) == (first, 0, now)
        later = client.next_images(after=tick.sequence)
        assert (later.state_id, later.dropped, later.tai_ns) == (ids[-1], 8, now + 9)
        running.simulator.hook = None
        # The picture is the one that lock-step gives of the same state.
        np.testing.assert_array_equal(later["nav"].dn, client.render(now + 9, "nav").dn)


def test_the_rate_is_the_servers() -> None:
    stream = StateStream(interval=0.5)
    states = [State(id=id, tai_ns=id, cameras=(Shot(camera="nav"),)) for id in range(4)]
    assert stream.accept(b"a", "a", states[0], now=10.0)
    assert stream.due(10.0)
    assert stream.take(10.0) == (b"a", states[0], 0)
    # States come faster than pictures may be taken: only the newest is shown, at its time.
    for state, now in zip(states[1:], (10.1, 10.2, 10.3), strict=True):
        assert stream.accept(b"a", "a", state, now)
        assert not stream.due(now)
    assert stream.next_event() == 10.5
    assert stream.due(10.5)
    assert stream.take(10.5) == (b"a", states[3], 2)
    assert not stream.due(20.0)


def test_without_a_newer_state_there_is_no_newer_picture(
    start_server: Starter, scenario: Scenario
) -> None:
    running = start_server(scenario)
    with Client(running.address, timeout_s=limit(10.0)) as client:
        client.send_state(scenario.epoch_tai_ns, NAV)
        tick = client.next_images()
        client.timeout_s = 0.6
        with pytest.raises(RemoteError) as caught:
            client.next_images(after=tick.sequence)
        assert caught.value.code == "DEADLINE"
        assert caught.value.retryable
        assert running.simulator.captured == 1


def test_a_second_owner_of_the_stream_is_refused_until_the_first_has_left(
    start_server: Starter, scenario: Scenario
) -> None:
    running = start_server(scenario)
    now = scenario.epoch_tai_ns
    with Client(running.address, name="first") as first, Client(running.address) as second:
        first.send_state(now, NAV)
        first.next_images()
        second.send_state(now + 1, NAV)
        with pytest.raises(RemoteError) as caught:
            second.next_images()
        assert caught.value.code == "NOT_OWNER"
        assert caught.value.detail == '"first" streams states here; it has not left'
        # Anybody may look on.
        assert second.next_images().tai_ns == now
        first.close()
        time.sleep(limit(0.2))
        id = second.send_state(now + 2, NAV)
        assert second.next_images().state_id == id


def test_a_state_that_cannot_be_is_refused_at_once(raw: RawLink, scenario: Scenario) -> None:
    state = {"type": "state", "id": 4, "tai_ns": scenario.epoch_tai_ns, "cameras": []}
    reply = raw.ask_map(state)
    assert (reply["code"], reply["field"], reply["id"]) == ("BAD_VALUE", "cameras", 4)


def test_a_monitor_shows_previews_and_says_what_it_left_out(
    start_server: Starter, scenario: Scenario
) -> None:
    running = start_server(scenario, monitor="tcp://127.0.0.1:*")
    assert "previews at tcp://127.0.0.1:" in running.front.summary
    address = running.front.summary.partition("previews at ")[2].partition(" ")[0]
    now = scenario.epoch_tai_ns
    seen: list[PreviewImage] = []
    with (
        Client(running.address, timeout_s=limit(20.0)) as client,
        PreviewClient(address, timeout_s=0.2) as previews,
    ):
        # A subscriber that has just come misses what is published before it is known.
        step = 0
        deadline = time.monotonic() + limit(20.0)
        while len(seen) < 3 and time.monotonic() < deadline:
            client.render(now + step, "nav")
            step += 1
            seen += [] if step % 10 else list(previews)
    assert seen[0].pixels.shape == (48, 64, 3)
    assert seen[0].pixels.dtype == np.uint8
    assert seen[0].pixels.max() > 50
    assert seen[0].camera == "nav"
    assert now <= seen[0].tai_ns < seen[1].tai_ns < now + step
    # What the subscriber had no room for is counted, and so no picture is lost in silence.
    first, last = seen[0], seen[-1]
    assert first.missed == 0
    assert sum(s.missed for s in seen[1:]) + len(seen) - 1 <= last.sequence - first.sequence


def test_a_subscriber_that_reads_nothing_holds_up_nobody(
    start_server: Starter, scenario: Scenario
) -> None:
    running = start_server(scenario, monitor="tcp://127.0.0.1:*")
    address = running.front.summary.partition("previews at ")[2].partition(" ")[0]
    with (
        PreviewClient(address) as lazy,
        Client(running.address, timeout_s=limit(20.0)) as client,
    ):
        client.render(scenario.epoch_tai_ns, "nav")
        times = []
        for step in range(40):
            start = time.perf_counter()
            client.render(scenario.epoch_tai_ns + step, "nav")
            times.append(time.perf_counter() - start)
        assert lazy is not None
    assert max(times) < limit(2.0)
